//! What runs at every tick must not allocate.

use nalgebra::{Isometry2, Point2, Vector2};
use standfast::assets::{self, Kind};
use standfast::geometry::SupportPolygon;
use standfast::lipm::{GainFamily, GainSet, OnlineSets, Pendulum, State};
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
