// An ankle strategy: torques of the ankles against the angular velocity with which the trunk tilts forward or back.

#include "standfast.hpp"

struct Ankles : standfast::Controller {
    // Parameters are read here, so that a missing one is an error before the first episode.
    explicit Ankles(const standfast::Json& hello) : Controller(hello), gain(parameters.at("gain").number()) {
        const std::string named = parameters.has("joints") ? parameters.at("joints").text() : "ankle_flexion";
        for (std::size_t i = 0; i < robot.joints.size(); ++i)
            if (robot.joints[i].name.find(named) != std::string::npos) ankles.push_back(i);
    }

    standfast::Command tick(const standfast::Sensed& sensed) override {
        standfast::Command command;
        command.q_ref = robot.home_q_ref;
        command.tau_ff = robot.home_tau_ff;
        for (const std::size_t i : ankles) command.tau_ff[i] += gain * sensed.gyro[1];
        command.phase = "ankles";
        command.numbers["tilt_rate"] = sensed.gyro[1];
        return command;
    }

    double gain;
    std::vector<std::size_t> ankles;
};

int main() { standfast::serve<Ankles>(); }
