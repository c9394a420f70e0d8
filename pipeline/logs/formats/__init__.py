"""Foreign files, one reader each, brought to one table: bags, arrays of MATLAB, HDF5 and NumPy."""
