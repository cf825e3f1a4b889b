"""Results: the content of result.json, and the folder of it with arrays, mesh and pictures."""

from fem_seal.results.arrays import read_contact, read_flow
from fem_seal.results.folder import ResultFolder
from fem_seal.results.result import Result
