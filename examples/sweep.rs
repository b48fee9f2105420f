use rand::{RngExt, SeedableRng};
use rayon::prelude::*;
use standfast::episode::*;
use standfast::*;
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let noise: f64 = std::env::var("NOISE").ok().map_or(0.0, |v| v.parse().unwrap());
    let imps: Vec<f64> = std::env::var("IMPS")
        .unwrap_or("0.5 1.0 1.5 2.0 2.2 2.4 2.6 3.0 3.4 3.8".into())
        .split(' ')
        .map(|v| v.parse().unwrap())
        .collect();
    let heads: Vec<f64> =
        std::env::var("HEADS").unwrap_or("0 45 90 180".into()).split(' ').map(|v| v.parse().unwrap()).collect();
    let robot = robot::Robot::load("ut-mu2").unwrap();
    for g in &a[1..] {
        let gains = lipm::gains::GainSet::parse(&assets::open(assets::Kind::Gains, g).unwrap()).unwrap();
        let design = control::Design::new(&robot, &gains, 0.002).unwrap();
        for &h in &heads {
            let out: Vec<String> = imps
                .par_iter()
                .map(|&i| {
                    let push = sim::Push { impulse_n_s: i, heading_deg: h, ..Default::default() };
                    let mut rng = rand::rngs::ChaCha8Rng::seed_from_u64(7);
                    let errors = (noise > 0.0).then(|| sim::SensorErrors {
                        noise_scale: noise,
                        bias_scale: 0.5,
                        normal: Box::new(move || rng.sample(rand_distr::StandardNormal)),
                    });
                    let r = episode::run(
                        &robot,
                        &design,
                        &EpisodeConfig { horizon_s: 4.5, ..Default::default() },
                        Disturbance { pushes: vec![push], sensor_errors: errors },
                        Until::Decided,
                        &mut |_| {},
                    );
                    match r.outcome {
                        Outcome::Recovered => format!("{:5.2}", r.settled_at_s.unwrap_or(9.0) - 0.5),
                        o => format!("{:>5}", &format!("{o:?}")[..1]),
                    }
                })
                .collect();
            println!("{g:>10} {h:4} {}", out.join(" "));
        }
    }
}
