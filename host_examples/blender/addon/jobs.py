"""Models and estimates that are made on a thread, so that they can be watched and stopped. The thread touches none of Blender's data."""

import threading


class Job:
    """One model under way. The library lets other threads run meanwhile."""

    def __init__(self, make, key):
        """`make(progress)` gives the result."""
        self.key, self.cancelled = key, False
        self.fraction, self.phase = 0.0, "precompute"
        self._make, self._made, self._failed = make, None, None
        self._thread = threading.Thread(target=self._work)
        self._thread.start()

    def _work(self):
        try:
            self._made = self._make(self._progress)
        except BaseException as error:  # raised again by result
            self._failed = error
        if self.cancelled and self._made is not None:
            self._made.close()
            self._made = None

    def _progress(self, phase, fraction):
        self.phase, self.fraction = phase, fraction
        return not self.cancelled

    def running(self):
        return self._thread.is_alive()

    def wait(self, seconds=None):
        """Waits for its end, at most so long."""
        self._thread.join(seconds)

    def cancel(self):
        """Stops it at the library's next word, tenths of a second on most meshes."""
        self.cancelled = True

    def text(self):
        """What it is doing."""
        return f"{'stopping: ' if self.cancelled else ''}{self.phase}, {100 * self.fraction:.0f} %"

    def result(self):
        """What was made; raises what went wrong."""
        self.wait()
        if self._made is None:
            raise self._failed or RuntimeError("the precompute was cancelled")
        return self._made


class Estimate:
    """The certificate of one frame under way, of a copy of the state."""

    def __init__(self, state, frame):
        self.frame, self._state, self.cancelled, self._left = frame, state, False, None
        self._found, self._failed = None, None
        self._thread = threading.Thread(target=self._work, daemon=True)
        self._thread.start()

    def _work(self):
        try:
            self._found = self._state.certify(self._watch)
        except BaseException as error:  # raised again by result
            self._failed = error
        finally:
            self._state.close()

    def _watch(self, residual):
        self._left = residual
        return not self.cancelled

    def cancel(self):
        """Stops it after the factorization that it is in."""
        self.cancelled = True

    def text(self):
        """What it is doing."""
        return f"estimating the error of frame {self.frame}" + ("" if self._left is None else f", {self._left:.1e} of the force left")

    def running(self):
        return self._thread.is_alive()

    def wait(self, seconds=None):
        """Waits for its end, at most so long."""
        self._thread.join(seconds)

    def result(self):
        """The certificate; raises what went wrong."""
        self.wait()
        if self._failed is not None:
            raise self._failed
        return self._found
