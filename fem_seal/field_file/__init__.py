"""Heights and gaps from files: what each format says, brought to metres.

Nothing here imports a format's library before a file of that format is read.
"""

from fem_seal.field_file.read import GAP_NAMES, HEIGHT_NAMES, read_map
from fem_seal.field_file.recorded import FieldMap, Recorded, Stated

__all__ = ["GAP_NAMES", "HEIGHT_NAMES", "FieldMap", "Recorded", "Stated", "read_map"]
