use standfast::episode::*;
use standfast::*;
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let robot = robot::Robot::load("ut-mu2").unwrap();
    let src = assets::open(assets::Kind::Gains, &a[1]).unwrap();
    let gains = lipm::gains::GainSet::parse(&src).unwrap();
    let t0 = std::time::Instant::now();
    let design = control::Design::new(&robot, &gains, 0.002).unwrap();
    eprintln!("design {:?} {:?}", t0.elapsed(), design.warning);
    let imp: f64 = a[2].parse().unwrap();
    let head: f64 = a[3].parse().unwrap();
    let step: f64 = a.get(4).map_or(0.001, |s| s.parse().unwrap());
    let push = sim::Push { impulse_n_s: imp, heading_deg: head, ..Default::default() };
    let config = EpisodeConfig { horizon_s: 4.0, physics_step_s: step, ..Default::default() };
    let t0 = std::time::Instant::now();
    let mut n = 0;
    println!("t,cx,cy,cz,ex,ey,vx,vy,evx,evy,zx,zy,zrx,zry,fz,gain,margin,tilt,tau,pcx,pcy");
    let r = episode::run(
        &robot,
        &design,
        &config,
        Disturbance { pushes: vec![push], sensor_errors: None },
        Until::Horizon,
        &mut |t: &Tick| {
            let tr = t.truth;
            let e = &t.controller.estimator.now;
            let s = &t.controller.supervisor;
            let z = tr.zmp.unwrap_or([f64::NAN; 2]);
            println!(
                "{:.4},{:.5},{:.5},{:.5},{:.5},{:.5},{:.4},{:.4},{:.4},{:.4},{:.5},{:.5},{:.5},{:.5},{:.2},{},{:.3},{:.3},{:.2},{:.4},{:.4}",
                tr.time_s,
                tr.com.x,
                tr.com.y,
                tr.com.z,
                e.com.x,
                e.com.y,
                tr.com_vel.x,
                tr.com_vel.y,
                e.com_vel.x,
                e.com_vel.y,
                z[0],
                z[1],
                s.zmp_ref.x,
                s.zmp_ref.y,
                tr.contact_force.z,
                s.gain,
                s.margin,
                tr.tilt_rad().to_degrees(),
                tr.tau.iter().fold(0.0f64, |m, v| m.max(v.abs())),
                tr.push_force.x,
                tr.push_force.y
            );
            n += 1;
        },
    );
    eprintln!("{:?} for {n} ticks", t0.elapsed());
    eprintln!("{r:?}");
}
