"""The colours that the methods of a comparison get in turn, in stills and curves alike. The full shell comes first."""

IN_TURN = ("green", "red", "blue", "purple", "orange", "teal", "yellow", "grey")


def colors_of(methods):
    """A colour's name for each method, in the order in which they come."""
    return {method: IN_TURN[k % len(IN_TURN)] for k, method in enumerate(dict.fromkeys(methods))}
