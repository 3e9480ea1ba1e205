"""Engine properties from the program's own table of hyperparameters. Used by tools/generate_hyperparameters.py."""
