"""Stands still: the servos hold the posture of the start, with the torques that carry the weight there. It does what the
built-in `hold` does, to the bit."""

import standfast


class Hold(standfast.Controller):
    def tick(self, sensed):
        return self.robot["home"].copy()


standfast.serve(Hold)
