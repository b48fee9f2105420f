//! What runs at every tick must not allocate.

use nalgebra::{DVector, Isometry2, Isometry3, Point2, Vector2, Vector3};
use standfast::assets::{self, Kind};
use standfast::control::footstep::{self, Necessity};
use standfast::control::inverse_dynamics::{Grip, InverseDynamics, Wanted};
use standfast::control::swing::{Lift, Swing};
use standfast::geometry::SupportPolygon;
use standfast::lipm::catching::{Means, plan};
use standfast::lipm::{GainFamily, GainSet, OnlineSets, Pendulum, State};
use standfast::robot::{PerFoot, Robot};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

/// The system's allocator, counting what this thread asks for.
struct Counting;

thread_local! {
    static COUNT: Cell<usize> = const { Cell::new(0) };
}

unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.with(|c| c.set(c.get() + 1));
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// A footstep is chosen and planned within the tick that finds it necessary.
#[test]
fn a_footstep_is_chosen_planned_and_followed_without_allocation() {
    let robot = Robot::load("ut-mu2").unwrap();
    let set = GainSet::parse(&assets::open(Kind::Gains, "paper").unwrap()).unwrap();
    let (rules, omega) = (set.stepping.unwrap(), robot.omega());
    let foothold = |y: f64| Isometry3::translation(0.0, y, 0.0);
    let footholds = PerFoot { left: foothold(0.0485), right: foothold(-0.0485) };
    let frame = Isometry2::identity();
    let mut height = 0.0_f64;
    let before = COUNT.with(Cell::get);
    for i in 0..100 {
        let necessity = Necessity {
            frame: &frame,
            soles: PerFoot { left: Point2::new(0.0, 0.0485), right: Point2::new(0.0, -0.0485) },
            stance: Vector2::new(0.0, 0.097),
            zmp_error: Vector2::new(0.001 * f64::from(i + 1), 0.01),
            load_n: PerFoot { left: 40.0, right: 40.0 },
            can_lift: PerFoot { left: true, right: true },
        };
        let footstep = footstep::choose(&rules, &necessity).unwrap();
        let (com, com_vel) = (Point2::new(0.01, 0.0), Vector2::new(0.4, 0.02));
        let lift = Lift { com, com_vel, footholds, zmp_margin: 0.003 };
        let mut swing = Swing::plan(omega, &rules, &robot.soles[footstep.foot.other()], footstep, &lift);
        while !swing.is_due() {
            swing.time_s += 0.002;
            height = height.max(swing.sole().0.translation.z).max(swing.pendulum().unwrap().com.x);
        }
    }
    assert_eq!(COUNT.with(Cell::get) - before, 0);
    assert!(height > 0.01);
}

#[test]
fn a_footstep_that_catches_is_planned_anew_without_allocation() {
    let weights = GainSet::load("catch").unwrap().catching.unwrap().weights;
    let means = Means {
        omega: 5.63,
        sole: [0.048, 0.035],
        zmp_margin: 0.003,
        reach: [[-0.15, 0.15], [0.075, 0.18]],
        home: Vector2::new(0.0, 0.097),
    };
    let before = COUNT.with(Cell::get);
    let far = (0..100).map(|i| plan(&weights, &means, Vector2::new(0.001 * f64::from(i), 0.05), 0.15).place.x);
    let far = far.fold(0.0, f64::max);
    assert_eq!(COUNT.with(Cell::get) - before, 0);
    assert!(far > 0.1);
}

/// Standing, past what the soles can give, and on one foot.
#[test]
fn inverse_dynamics_are_solved_without_allocation() {
    let robot = Robot::load("ut-mu2").unwrap();
    let mut body = InverseDynamics::new(&robot, Grip { friction: 0.6, sole_share: 0.95 });
    let (posture, velocity) = (robot.home_posture(), DVector::from_element(6 + robot.joints.len(), 0.1));
    let mut wanted = Wanted::rest(&robot, PerFoot { left: true, right: true });
    let mut torque_ratio = 0.0;
    let before = COUNT.with(Cell::get);
    for i in 0..100 {
        wanted.com_acc = Vector3::new(0.1 * f64::from(i), 1.0, 0.0);
        wanted.standing.right = i % 10 < 5;
        torque_ratio += body.solve(&robot, &posture, &velocity, &wanted).torque_ratio;
    }
    assert_eq!(COUNT.with(Cell::get) - before, 0);
    assert!(torque_ratio > 0.0);
}

#[test]
fn support_and_sets_are_updated_and_asked_without_allocation() {
    let set = GainSet::parse(&assets::open(Kind::Gains, "switching").unwrap()).unwrap();
    let family = GainFamily::design(&set, Pendulum { omega: 5.63, dt: 0.002 }).unwrap();
    let mut online = OnlineSets::new(&family);
    let sole = SupportPolygon::rectangle(-0.0481, 0.0481, -0.0346, 0.0346).unwrap();
    let mut held = 0;
    let before = COUNT.with(Cell::get);
    for i in 0..100 {
        let mut corners = [Point2::origin(); 8];
        for (foot, side) in [1.0, -1.0].into_iter().enumerate() {
            let pose = Isometry2::new(Vector2::new(0.001 * side * i as f64, 0.0485 * side), 0.003 * i as f64);
            corners[4 * foot..4 * foot + 4].copy_from_slice(sole.transformed(&pose).vertices());
        }
        let support = SupportPolygon::hull(&corners).and_then(|hull| hull.inset(family.zmp_margin)).unwrap();
        online.update(&support);
        let state = State { x: [0.0, 0.003 * i as f64, 0.0].into(), y: [0.01, 0.0, 0.0].into() };
        held += usize::from(online.fastest_holding(&state).is_some());
        held += usize::from(online.margin(0, &state) >= 0.0);
    }
    assert_eq!(COUNT.with(Cell::get) - before, 0);
    assert!(held > 0);
}
