"""The effects a model may lack, by where they act, and the model file that lists them."""
