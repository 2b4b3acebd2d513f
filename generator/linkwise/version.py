"""The version, of linkwise and of what it generates."""

VERSION = "0.1.0"
