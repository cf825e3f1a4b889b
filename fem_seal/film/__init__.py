"""The film, the domain of the fluid: a gap, its interpolation between values, and its sides."""

from fem_seal.film.grid_film import GridFilm, require_film
from fem_seal.film.law import film_conductivity
from fem_seal.film.mesh_film import MeshFilm

Film = GridFilm | MeshFilm
