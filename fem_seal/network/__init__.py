"""The network of links on which the pressure of the fluid that lifts a solid is solved."""
