"""The robot languages: one folder each, with the same file names in each."""
