"""What all buffers are: arrays that pass one gate."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
NO_ROOM = -2                                            # .listed of a list that had too little room


def gate(values: Any, dtype: Any) -> Array:
    """The one way into a kernel: C-contiguous, of exactly this type, so that no signature is compiled twice."""
    return np.require(np.asarray(values), dtype=dtype, requirements=["C", "A", "W", "O"])
