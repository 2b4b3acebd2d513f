"""The cases that `linkwise example` puts into a folder, a folder each, and SHA256SUMS, their hashes."""
