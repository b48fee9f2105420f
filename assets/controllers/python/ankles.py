"""An ankle strategy: torques of the ankles against the angular velocity with which the trunk tilts forward or back."""

import standfast


class Ankles(standfast.Controller):
    phase = "ankles"

    def __init__(self, hello):
        super().__init__(hello)
        named = self.parameters.get("joints", "ankle_flexion")
        self.ankles = [i for i, name in enumerate(self.joints) if named in name]
        self.gain = self.parameters["gain"]

    def tick(self, sensed):
        home = self.robot["home"]
        torques = home["tau_ff"].copy()
        for i in self.ankles:
            torques[i] += self.gain * sensed["gyro"][1]
        return {"q_ref": home["q_ref"], "tau_ff": torques, "numbers": {"tilt_rate": sensed["gyro"][1]}}


standfast.serve(Ankles)
