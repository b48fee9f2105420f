// Stands still: the servos hold the posture of the start, with the torques that carry the weight there. It does what
// the built-in `hold` does, to the bit.

#include "standfast.hpp"

struct Hold : standfast::Controller {
    using Controller::Controller;

    standfast::Command tick(const standfast::Sensed&) override {
        standfast::Command command;
        command.q_ref = robot.home_q_ref;
        command.tau_ff = robot.home_tau_ff;
        return command;
    }
};

int main() { standfast::serve<Hold>(); }
