"""Reads firmware/params/parameters.yaml and writes what is made from it: see tools/gen_dictionary.py."""
