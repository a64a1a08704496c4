"""Array types of this room, beside those that messages carry."""

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

IntArray: TypeAlias = NDArray[np.int_]
IndexArray: TypeAlias = NDArray[np.int32]
RealArray: TypeAlias = NDArray[np.floating[Any]]
"""Of either precision: where an intermediate's doesn't matter."""
