"""The cases that `linkwise example` puts into a folder, a folder each, and SHA256SUMS with the hash of every file."""
