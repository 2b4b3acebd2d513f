"""The native back end: the C code, compiled at first use and called on arrays and CPU tensors."""
