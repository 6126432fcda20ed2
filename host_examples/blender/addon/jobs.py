"""Models and estimates that are made on a thread, so that they can be watched and stopped. The thread touches none of Blender's data."""

import threading

TRAINING = "training"  # what a precompute is called while it makes a reduced shell, or tries methods


class Job:
    """One model under way. The library lets other threads run meanwhile."""

    def __init__(self, make, key, trains):
        """`make(progress)` gives the result; `trains`: the last phase is a training."""
        self.key, self.cancelled, self._trains = key, False, trains
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
        self.phase, self.fraction = (TRAINING if self._trains and phase == "rotation" else phase), fraction
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
    """The certificate of one frame under way, of a copy of the state. The library cannot break it off: who has no use for it any more
    leaves it, and it ends by itself."""

    def __init__(self, state, frame):
        self.frame, self._state = frame, state
        self._found, self._failed = None, None
        self._thread = threading.Thread(target=self._work, daemon=True)
        self._thread.start()

    def _work(self):
        try:
            self._found = self._state.certify()
        except BaseException as error:  # raised again by result
            self._failed = error
        finally:
            self._state.close()

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
