"""Reading and writing RGB-D sequences: one file a format, one protocol for all of them."""
