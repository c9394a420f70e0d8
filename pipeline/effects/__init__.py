"""The effects a model may lack, one file each, and the model file that lists them."""
