//! Torques that carry the weight.

use standfast_core::robot::{GRAVITY, Kinematics};
/// In the plane of the leg, the knee carries the weight at the ZMP, less what hangs below it.
#[test]
fn the_knee_of_ut_mu2_carries_the_body_on_one_leg() {
    let robot = standfast_robots::load("ut-mu2").unwrap();
    let kinematics = Kinematics::at_home(&robot);
    let (knee, share) = robot.hardest_on_one_leg().unwrap();
    assert!(
        robot.joints[knee].name.ends_with("knee_flexion"),
        "{}",
        robot.joints[knee].name
    );
    let (below_kg, below) = kinematics.subtree(knee + 1);
    let at_x = kinematics.joint_position(knee).x;
    let moment = robot.mass() * (kinematics.com().x - at_x) - below_kg * (below.x - at_x);
    let by_hand =
        (GRAVITY * moment * kinematics.joint_axis(knee).y).abs() / robot.servos[knee].torque_n_m;
    assert!((share - by_hand).abs() < 1e-9, "{share} {by_hand}");
    assert!(0.4 < share && share < 0.5, "{share}");
}
