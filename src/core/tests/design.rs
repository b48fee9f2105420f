//! What a robot must be to catch.

use standfast_controllers::gain_set;
use standfast_core::control::Design;
use standfast_core::robot::LandingRegion;
use standfast_core::robot::Robot;

#[test]
fn what_a_robot_must_be_to_catch_is_said() {
    let (robot, gains) = (
        standfast_robots::load("ut-mu2").unwrap(),
        gain_set("catch").unwrap(),
    );
    let beside = robot.reach[0].clone();
    let with = |reach: Option<LandingRegion>| Robot {
        reach: reach.into_iter().collect(),
        ..robot.clone()
    };
    for (robot, period_s, words) in [
        (
            with(Some(LandingRegion {
                y_m: [0.1, 0.18],
                ..beside.clone()
            })),
            0.002,
            "ut-mu2: reach[0] = -0.15 to 0.15 m forward and 0.1 to 0.18 m to the side: does not contain the stance at \
             home; accepted: x_m on both sides of 0, and y_m on both sides of the distance between its soles, 0.0970 m",
        ),
        (
            with(Some(LandingRegion {
                swing_time_s: 0.14,
                ..beside
            })),
            0.015,
            "ut-mu2: reach[0].swing_time_s = 0.14 s: is too short; accepted: 0.15 s (10 control periods) or more",
        ),
    ] {
        let error = Design::new(&robot, &gains, period_s).unwrap_err();
        assert_eq!(error.exit_code(), 2);
        assert!(
            error.to_string().starts_with(words),
            "{error}\nwanted: {words}"
        );
    }
    assert!(Design::new(&robot, &gains, 0.002).is_ok());
    // Without a reach, the robot stands as well as it can without footsteps.
    let warning = |name| {
        let design = Design::new(&with(None), &gain_set(name).unwrap(), 0.002).unwrap();
        design.warning.unwrap_or_default()
    };
    assert!(warning("catch").ends_with(
        "takes no footsteps, as it is not known where the feet of ut-mu2 can land ([[reach]] of its settings)"
    ));
    assert_eq!(warning("fixed"), "");
}
