"""Types that the package's signatures name."""

from typing import Any, Union

from numpy.typing import NDArray

Array = NDArray[Any]
Buffer = Union[bytes, bytearray, memoryview]
Report = dict[str, Any]   # a report of the interface, by the names of its fields
