//! Tests of whole pictures: geometry, light, marks and ground are where they should be.

use super::Camera;
use super::draw::{draw, draw_on, draw_posture};
use crate::scene::Stage;
use crate::scene::palette::Overlay;
use image::RgbImage;
use nalgebra::{Isometry3, Point2, Point3, UnitQuaternion, Vector3};
use standfast_core::robot::{Foot, Link, PerFoot, Pose, Posture, Robot, Shape, Solid};
use standfast_core::socket::RecoveryRegion;
use standfast_sim::Ground;
use standfast_sim::episode::Snapshot;
use standfast_sim::episode::snapshot::Arrow;

const SIZE: [u32; 2] = [320, 240];
const FRONT: Camera = Camera {
    target: Point3::new(0.0, 0.0, 0.26),
    azimuth_deg: 50.0,
    elevation_deg: 17.0,
    distance_m: 1.3,
    fov_deg: 30.0,
};

fn ut_mu2() -> Robot {
    standfast_robots::load("ut-mu2").unwrap()
}

/// UT-mu2 at rest, with a value for every mark.
fn snapshot(robot: &Robot) -> Snapshot {
    let square = |x: f64, half: f64| {
        [(half, half), (-half, half), (-half, -half), (half, -half)]
            .map(|(dx, dy)| Point2::new(x + dx, dy))
    };
    let arrow = |x: f64, y: f64, z: f64, force: Vector3<f64>| Arrow {
        point: Point3::new(x, y, z),
        force,
    };
    Snapshot {
        time_s: 0.5,
        posture: robot.home_posture(),
        com: Point3::new(0.0, 0.0, 0.3),
        dcm: Point2::new(0.15, 0.0),
        dcm_outside_m: 0.0,
        zmp: Some(Point2::new(0.2, 0.05)),
        zmp_ref: Some(Point2::new(0.2, -0.05)),
        soles: PerFoot::default(),
        support: square(0.0, 0.15).to_vec(),
        regions: [("slow", 0.13), ("fast", 0.1)]
            .map(|(name, half)| RecoveryRegion {
                name: name.into(),
                corners: square(0.0, half).into(),
            })
            .into(),
        gain: Some("fast".into()),
        margin: None,
        phase: "swing-left".into(),
        in_air: Some(Foot::Left),
        footstep: Some(square(0.25, 0.03).map(|at| Point3::new(at.x, at.y, 0.0))),
        contacts: PerFoot {
            left: Some(arrow(0.1, 0.1, 0.0, Vector3::z() * 60.0)),
            right: None,
        },
        push: Some(arrow(0.0, 0.0, 0.3, Vector3::x() * -70.0)),
        slope: UnitQuaternion::identity(),
    }
}

/// A robot that consists of boxes (centre, half size, colour), and its posture.
fn boxes(boxes: &[([f64; 3], [f64; 3], [f64; 4])]) -> (Robot, Posture) {
    let mut robot = ut_mu2();
    for Link {
        visuals,
        collisions,
        ..
    } in &mut robot.links
    {
        visuals.clear();
        collisions.clear();
    }
    robot.links[0].visuals = boxes
        .iter()
        .map(|&(center, half, color)| Solid {
            frame: 0,
            pose: Isometry3::translation(center[0], center[1], center[2]),
            shape: Shape::Box { half: half.into() },
            color,
        })
        .collect();
    let posture = Posture {
        base: Pose::identity(),
        ..robot.zero_posture()
    };
    (robot, posture)
}

const RED: [f64; 4] = [0.9, 0.1, 0.1, 1.0];
const GREEN: [f64; 4] = [0.1, 0.8, 0.1, 1.0];

/// The colour of a picture at the place of a point.
fn at(image: &RgbImage, camera: &Camera, point: Point3<f64>) -> [u8; 3] {
    let [x, y] = camera.project(point, SIZE).unwrap().map(|px| px as u32);
    image.get_pixel(x, y).0
}

fn is_green([r, g, b]: [u8; 3]) -> bool {
    u16::from(g) > u16::from(r.max(b)) + 20
}

fn is_red([r, g, b]: [u8; 3]) -> bool {
    u16::from(r) > 2 * u16::from(g.max(b))
}

/// A ghost is transparent, hidden by objects before it, and invisible at the place of the robot. It casts no shadow.
#[test]
fn a_ghost_is_seen_beside_the_robot_and_not_over_it() {
    let (robot, posture) = boxes(&[([0.0, 0.0, 0.3], [0.05; 3], RED)]);
    let (stage, moment) = (
        Stage::new(&robot, Ground::default()),
        Snapshot {
            posture,
            ..snapshot(&robot)
        },
    );
    let camera = Camera {
        azimuth_deg: 0.0,
        elevation_deg: 0.0,
        ..FRONT
    };
    let moved = |x: f64, y: f64| {
        let base = Pose::translation(x, y, 0.0);
        Snapshot {
            posture: Posture {
                base,
                ..moment.posture.clone()
            },
            ..moment.clone()
        }
    };
    let with = |ghost: &Snapshot| draw_on(&stage, &moment, Some(ghost), &camera, SIZE, &[]);
    let without = draw_on(&stage, &moment, None, &camera, SIZE, &[]);
    assert!(
        with(&moved(0.0, 0.0)) == without,
        "at the place of the robot"
    );
    assert!(with(&moved(-0.2, 0.0)) == without, "behind it");
    let beside = with(&moved(0.0, 0.15));
    let middle = Point3::new(0.05, 0.15, 0.3);
    let [before, after] = [&without, &beside].map(|image| at(image, &camera, middle));
    assert!(
        after[0] + 20 < before[0] && after[2] > after[0] + 20,
        "{before:?} {after:?}"
    );
    let under = Point3::new(0.0, 0.15, 0.0);
    let [before, after] = [&without, &beside].map(|image| at(image, &camera, under));
    assert_eq!(before, after, "its shadow");
    let before = at(
        &with(&moved(0.2, 0.0)),
        &camera,
        Point3::new(0.25, 0.0, 0.3),
    );
    assert!(
        is_red(at(&without, &camera, Point3::new(0.05, 0.0, 0.3))) && !is_red(before),
        "{before:?}"
    );
}

#[test]
fn pictures_have_the_same_bytes_with_any_number_of_threads() {
    let robot = ut_mu2();
    let picture = || draw(&robot, &snapshot(&robot), &FRONT, SIZE, &Overlay::ALL);
    let first = picture();
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        assert!(pool.install(picture) == first, "{threads} threads");
    }
    assert_eq!(first.dimensions(), (SIZE[0], SIZE[1]));
}

#[test]
fn near_solids_hide_far_ones_in_any_order() {
    let (near, far) = (
        ([0.2, 0.0, 0.26], [0.05; 3], RED),
        ([-0.2, 0.0, 0.26], [0.06; 3], GREEN),
    );
    let pictures = [[near, far], [far, near]].map(|order| {
        let (robot, posture) = boxes(&order);
        draw_posture(
            &robot,
            &posture,
            &Camera {
                azimuth_deg: 0.0,
                elevation_deg: 0.0,
                ..FRONT
            },
            SIZE,
        )
    });
    assert!(pictures[0] == pictures[1]);
    assert!(is_red(pictures[0].get_pixel(160, 120).0));
    // The floor hides what is below it.
    let (robot, posture) = boxes(&[([0.0, 0.0, -0.3], [0.1; 3], RED)]);
    let image = draw_posture(
        &robot,
        &posture,
        &Camera {
            target: Point3::origin(),
            ..FRONT
        },
        SIZE,
    );
    assert!(!image.pixels().any(|pixel| is_red(pixel.0)));
}

#[test]
fn a_shadow_lies_on_the_floor_away_from_the_lamp() {
    let (robot, posture) = boxes(&[([0.0, 0.0, 0.3], [0.05; 3], RED)]);
    let camera = Camera {
        target: Point3::origin(),
        azimuth_deg: 0.0,
        ..FRONT
    };
    let image = draw_posture(&robot, &posture, &camera, SIZE);
    // The lamp stands 1.5 high, 0.75 towards the camera (+x) and 0.8 to its left (-y) for a shadow at the origin.
    let floor_at = |x: f64, y: f64| u32::from(at(&image, &camera, Point3::new(x, y, 0.0))[1]);
    let (shaded, lit) = (floor_at(-0.15, 0.16), floor_at(-0.15, -0.16));
    assert!(shaded + 40 < lit, "{shaded} {lit}");
}

#[test]
fn each_mark_is_seen_in_its_colour() {
    let robot = ut_mu2();
    let moment = snapshot(&robot);
    let bare = draw(&robot, &moment, &FRONT, SIZE, &[]);
    assert!(bare == draw_posture(&robot, &moment.posture, &FRONT, SIZE));
    // For each overlay: a place where it is visible, an offset to the right (px), and the channel that is strongest
    // there.
    let on_floor = |x: f64, y: f64| Point3::new(x, y, 0.0);
    let cases = [
        (Overlay::Support, on_floor(0.149, 0.1), 0, 2),
        (Overlay::Slices, on_floor(0.09, -0.09), 0, 2),
        (Overlay::Footstep, on_floor(0.25, 0.0), 0, 2),
        (Overlay::Contacts, Point3::new(0.1, 0.1, 0.03), 0, 1),
        (Overlay::Push, Point3::new(0.2, 0.0, 0.3), 0, 0),
        (Overlay::Com, Point3::new(0.0, 0.0, 0.3), 5, 2),
        (Overlay::Dcm, on_floor(0.15, 0.0), 0, 1),
        (Overlay::ZmpRef, on_floor(0.2, -0.05), 5, 0),
        (Overlay::Zmp, on_floor(0.2, 0.05), 0, 0),
    ];
    assert_eq!(cases.each_ref().map(|(mark, ..)| *mark), Overlay::ALL);
    for (mark, place, right_px, channel) in cases {
        let image = draw(&robot, &moment, &FRONT, SIZE, &[mark]);
        let [x, y] = FRONT.project(place, SIZE).unwrap().map(|px| px as u32);
        let [now, before] = [&image, &bare].map(|image| image.get_pixel(x + right_px, y).0);
        assert_ne!(now, before, "{mark:?}");
        let strongest = (0..3).max_by_key(|&i| now[i]).unwrap();
        assert!(now[channel] == now[strongest], "{mark:?}: {now:?}");
    }
    // A mark below the sole is not hidden by the foot.
    let beneath = Snapshot {
        zmp: Some(Point2::new(-0.03, 0.05)),
        ..moment
    };
    let image = draw(&robot, &beneath, &FRONT, SIZE, &[Overlay::Zmp]);
    let [r, g, b] = at(&image, &FRONT, on_floor(-0.03, 0.05));
    assert!(r > g.max(b) + 60, "{r} {g} {b}");
}

#[test]
fn a_slope_tilts_the_floor_and_the_marks_on_it() {
    let robot = ut_mu2();
    let level = snapshot(&robot);
    let slope = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 0.2);
    let tilted = Snapshot {
        slope,
        ..level.clone()
    };
    let marks = [Overlay::Dcm];
    let image = draw(&robot, &tilted, &FRONT, SIZE, &marks);
    // The DCM is at x = 0.15 m, where the floor is lower since it falls forward.
    let seen = |z: f64| at(&image, &FRONT, Point3::new(0.15, 0.0, z));
    assert!(is_green(seen(-0.15 * 0.2_f64.tan())) && !is_green(seen(0.0)));
}

/// The patch is lower or higher than the ground around it. Marks and walls follow the ground.
#[test]
fn a_step_in_the_ground_is_seen_and_marks_lie_on_it() {
    let robot = boxes(&[]).0;
    let moment = Snapshot {
        zmp: Some(Point2::new(0.15, 0.0)),
        ..snapshot(&robot)
    };
    let marks = [Overlay::Zmp];
    let patch = [Point2::new(-0.07, -0.1), Point2::new(0.07, 0.1)];
    let camera = Camera {
        target: Point3::origin(),
        azimuth_deg: 0.0,
        distance_m: 0.8,
        ..FRONT
    };
    let flat = draw(&robot, &moment, &camera, SIZE, &marks);
    let on = |ground: Ground| {
        draw_on(
            &Stage::new(&robot, ground),
            &moment,
            None,
            &camera,
            SIZE,
            &marks,
        )
    };
    assert!(
        flat == on(Ground {
            patch,
            ..Ground::default()
        })
    );
    for step_m in [0.02, -0.02] {
        let image = on(Ground {
            step_m,
            patch,
            ..Ground::default()
        });
        for (x, is_dot) in [(0.15, true), (0.12, false), (0.18, false)] {
            assert_eq!(
                is_red(at(&image, &camera, Point3::new(x, 0.0, step_m))),
                is_dot,
                "{step_m} m: {x}"
            );
        }
        let light =
            |x: f64, y: f64, z: f64| u16::from(at(&image, &camera, Point3::new(x, y, z))[1]);
        // Between lines of the grid.
        let (around, patch) = (light(-0.03, 0.15, step_m), light(-0.03, 0.05, 0.0));
        assert!(around > patch + 8, "{step_m} m: {around}, {patch}");
        // In a pit the far wall is visible, on a plateau the near one.
        let wall_x = if step_m > 0.0 { -0.07 } else { 0.07 };
        let wall = light(wall_x, 0.05, step_m / 2.0);
        assert!(patch > wall + 15, "{step_m} m: {patch}, {wall}");
        let unseen = light(-wall_x, 0.05, step_m / 2.0);
        assert!(unseen > wall + 15, "{step_m} m: {unseen}, {wall}");
    }
}

#[test]
fn nothing_breaks_at_odd_cameras_and_sizes() {
    let robot = ut_mu2();
    let moment = snapshot(&robot);
    for size in [[0, 0], [1, 1], [7, 200]] {
        assert_eq!(
            draw(&robot, &moment, &FRONT, size, &Overlay::ALL).dimensions(),
            (size[0], size[1])
        );
    }
    // The cameras are inside of the robot, below the floor, and straight above.
    for camera in [
        Camera {
            distance_m: 0.01,
            ..FRONT
        },
        Camera {
            elevation_deg: -40.0,
            ..FRONT
        },
        Camera {
            elevation_deg: 90.0,
            ..FRONT
        },
    ] {
        draw(&robot, &moment, &camera, [40, 30], &Overlay::ALL);
    }
}
