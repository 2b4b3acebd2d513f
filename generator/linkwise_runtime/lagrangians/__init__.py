"""The autograd back end: each link's Lagrangian as a torch module, differentiated at run time."""
