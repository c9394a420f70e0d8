"""The effects a model may lack, one file each."""
