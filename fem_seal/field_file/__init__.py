"""Heights and gaps from files of many formats, converted to metres.

The library of a format is imported only when a file of that format is read.
"""

from fem_seal.field_file.read import GAP_NAMES, HEIGHT_NAMES, read_map
from fem_seal.field_file.recorded import FieldMap, Recorded, Stated
