"""Types that the package's signatures name."""

from typing import Any, Literal, Union

from numpy.typing import NDArray

Array = NDArray[Any]
Buffer = Union[bytes, bytearray, memoryview]
Steps = Union[int, Literal["auto"]]   # Newton steps of the full shell, or as many as a state at rest needs
Report = dict[str, Any]   # a report of the interface, by the names of its fields
