use super::*;
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

fn steep() -> Vec<(f64, bool)> {
    (1..=60).map(|i| (0.1 * i as f64, i < 27 || [29, 30, 33].contains(&i))).collect()
}

fn flat() -> Vec<(f64, bool)> {
    (0..80).map(|i| (1.0 + 0.05 * i as f64, (i * 37) % 100 + i < 110)).collect()
}

fn outcomes(recovered: &[f64], fell: &[f64]) -> Vec<(f64, bool)> {
    recovered.iter().map(|&x| (x, true)).chain(fell.iter().map(|&x| (x, false))).collect()
}

fn parted() -> Vec<(f64, bool)> {
    outcomes(&[1.0, 2.0, 2.5, 1.5], &[4.0, 4.5, 6.0, 5.0])
}

fn touching() -> Vec<(f64, bool)> {
    outcomes(&[1.0, 1.5, 2.0, 3.0, 3.0, 3.0], &[3.0, 3.0, 4.0, 5.0, 4.5, 6.0])
}

fn close(found: f64, expected: f64) {
    assert!((found - expected).abs() < 2e-7, "{found} is not {expected}");
}

fn level_is(level: Option<Level>, at: f64, low: Option<f64>, high: Option<f64>) {
    let level = level.unwrap();
    close(level.at, at);
    for (found, expected) in level.ci95.into_iter().zip([low, high]) {
        assert_eq!(found.is_some(), expected.is_some(), "{level:?}");
        close(found.unwrap_or_default(), expected.unwrap_or_default());
    }
}

fn band_is(pushes: &Pushes, x: f64, expected: [f64; 2]) {
    let found = pushes.band(x);
    close(found[0], expected[0]);
    close(found[1], expected[1]);
}

// Expected values here and below: fits of statsmodels 0.15.0 `GLM(family=Binomial())`; ends of intervals by brentq of
// scipy 1.17.1 on the likelihood, maximised over the slope by `minimize_scalar` from a grid.
#[test]
fn fit_and_intervals_are_those_of_others() {
    let pushes = Pushes::new(&steep());
    let curve = pushes.curve().unwrap();
    assert_eq!((curve.trials, curve.recovered, curve.range), (60, 29, [0.1, 6.0]));
    close(curve.x50, 2.949999755175256);
    close(curve.s, 0.21995903575536807);
    level_is(curve.impulse50, 2.949999755175256, Some(2.5510895226026147), Some(3.348876198810404));
    level_is(curve.impulse90, 2.466700355806385, Some(1.6354613279531072), Some(2.8931174366207975));
    band_is(&pushes, 2.0, [0.8051784338263148, 0.9999793958304143]);
    band_is(&pushes, 3.0, [0.10444086205540729, 0.8184644980413335]);
    band_is(&pushes, 4.5, [3.2619524564905315e-08, 0.06420746542418596]);
    close(curve.chance(2.949999755175256 - 0.21995903575536807 * 9f64.ln()), 0.9);

    let pushes = Pushes::new(&flat());
    let curve = pushes.curve().unwrap();
    close(curve.s, 0.9518502044441804);
    level_is(curve.impulse50, 4.040627173852578, Some(3.5270888447616864), None);
    level_is(curve.impulse90, 1.9491985107053198, None, Some(2.6824956114417375));
    band_is(&pushes, 1.5, [0.8295043494336533, 0.982691477422309]);
    band_is(&pushes, 4.9, [0.1283845418179804, 0.5096981051407421]);
}

#[test]
fn six_trials_bound_little() {
    let pushes = Pushes::new(&outcomes(&[1.0, 2.0, 3.5], &[3.0, 4.0, 5.0]));
    let curve = pushes.curve().unwrap();
    level_is(curve.impulse50, 3.162617337568636, None, None);
    level_is(curve.impulse90, 2.051454818747205, None, Some(3.547474908075821));
    band_is(&pushes, 3.2, [0.024151327459323843, 0.9742810470974905]);
}

#[test]
fn a_step_is_put_midway_and_bounded_all_the_same() {
    let pushes = Pushes::new(&parted());
    let curve = pushes.curve().unwrap();
    assert_eq!((curve.x50, curve.s), (3.25, 0.0));
    assert_eq!([3.0, 3.25, 3.5].map(|x| curve.chance(x)), [1.0, 0.5, 0.0]);
    level_is(curve.impulse50, 3.25, Some(1.8036188625636635), Some(4.7557234140294655));
    level_is(curve.impulse90, 3.25, None, Some(4.063734670570543));
    band_is(&pushes, 2.0, [0.4242387982000711, 1.0]);
    band_is(&pushes, 3.2, [0.0, 1.0]);
    band_is(&pushes, 4.8, [0.0, 0.4871134328138614]);
}

#[test]
fn a_step_may_lie_at_one_impulse_that_ends_either_way() {
    let pushes = Pushes::new(&touching());
    let curve = pushes.curve().unwrap();
    assert_eq!((curve.x50, curve.s), (3.0, 0.0));
    level_is(curve.impulse50, 3.0, Some(1.9502960947269694), Some(4.498045079645667));
    level_is(curve.impulse90, 3.0, None, Some(3.1701938305720034));
    band_is(&pushes, 2.0, [0.4901279334543888, 1.0]);
    band_is(&pushes, 3.0, [0.1318627469987206, 0.9554927893486381]);
    band_is(&pushes, 4.0, [0.0, 0.6106034489444582]);
}

#[test]
fn without_a_curve_there_is_a_reason() {
    let why = |trials: &[(f64, bool)]| Pushes::new(trials).curve().unwrap_err();
    assert_eq!(why(&[]), NoCurve::NoTrials);
    assert_eq!(why(&outcomes(&[1.0, 2.0], &[])), NoCurve::AllRecovered);
    assert_eq!(why(&outcomes(&[], &[1.0, 1.0])), NoCurve::NoneRecovered);
    assert_eq!(why(&outcomes(&[2.0], &[2.0, 2.0])), NoCurve::OneImpulse);
    assert_eq!(why(&outcomes(&[2.0, 3.0], &[1.0, 2.0])), NoCurve::NotFalling);
    assert_eq!(why(&outcomes(&[1.0, 3.0, 4.0], &[1.0, 2.0, 2.5])), NoCurve::NotFalling);
    assert_eq!(Pushes::new(&outcomes(&[2.0, 3.0], &[1.0])).band(2.0), [0.0, 1.0]);
    assert_eq!(NoCurve::NotFalling.to_string(), "success does not fall with impulse");
}

#[test]
fn no_push_supports_a_level_outside_of_their_range() {
    // Recovery from 95, 90 and 80 % of 20 pushes each, and the same with falls.
    let mut weak = Vec::new();
    for (x, fell) in [(1.0, 1), (2.0, 2), (3.0, 4)] {
        weak.extend((0..20).map(|i| (x, i >= fell)));
    }
    let curve = Pushes::new(&weak).curve().unwrap();
    assert_eq!((curve.impulse50, curve.no_impulse50), (None, Some(NoCurve::AboveRange)));
    assert!(curve.impulse90.is_some() && curve.no_impulse90.is_none() && curve.x50 > 3.0);
    let hard: Vec<_> = weak.iter().map(|&(x, recovered)| (4.0 - x, !recovered)).collect();
    let curve = Pushes::new(&hard).curve().unwrap();
    assert_eq!((curve.no_impulse50, curve.no_impulse90), (Some(NoCurve::BelowRange), Some(NoCurve::BelowRange)));
}

#[test]
fn neither_unit_nor_order_nor_mirror_matters() {
    let curve = Pushes::new(&flat()).curve().unwrap();
    let mut scaled: Vec<_> = flat().iter().map(|&(x, recovered)| (1e-3 * x, recovered)).collect();
    scaled.reverse();
    let small = Pushes::new(&scaled).curve().unwrap();
    close(1e3 * small.x50, curve.x50);
    close(1e3 * small.impulse90.unwrap().ci95[1].unwrap(), curve.impulse90.unwrap().ci95[1].unwrap());
    let mirrored: Vec<_> = flat().iter().map(|&(x, recovered)| (10.0 - x, !recovered)).collect();
    let mirrored = Pushes::new(&mirrored).curve().unwrap().impulse50.unwrap();
    level_is(Some(mirrored), 10.0 - 4.040627173852578, None, Some(10.0 - 3.5270888447616864));
}

/// An impulse is in the interval of 50 % exactly if the band at this impulse contains 50 %.
#[test]
fn band_and_interval_are_the_same_question() {
    for trials in [steep(), parted()] {
        let pushes = Pushes::new(&trials);
        let [low, high] = pushes.curve().unwrap().impulse50.unwrap().ci95.map(Option::unwrap);
        close(pushes.band(low)[0], 0.5);
        close(pushes.band(high)[1], 0.5);
    }
}

/// How many of 500 intervals of x50 and of x90, and of bands at `x`, contain the truth from which the trials are drawn.
fn held(n: u64, x50: f64, s: f64, x: f64) -> [u64; 3] {
    let mut rng = ChaCha8Rng::seed_from_u64(n);
    let truth = |x: f64| chance((x50 - x) / s);
    let mut held = [0; 3];
    for _ in 0..500 {
        let trials: Vec<(f64, bool)> = (0..n)
            .map(|_| {
                let x = 6.0 * rng.random::<f64>();
                (x, rng.random::<f64>() < truth(x))
            })
            .collect();
        let pushes = Pushes::new(&trials);
        let curve = pushes.curve().unwrap();
        for (held, (level, at)) in held.iter_mut().zip([(curve.impulse50, x50), (curve.impulse90, x50 - s * 9f64.ln())])
        {
            let [low, high] = level.unwrap().ci95;
            *held += u64::from(low.is_none_or(|low| low <= at) && high.is_none_or(|high| at <= high));
        }
        let [low, high] = pushes.band(x);
        held[2] += u64::from(low <= truth(x) && truth(x) <= high);
    }
    held
}

#[test]
fn intervals_hold_at_95_percent() {
    for (n, s) in [(40, 0.02), (40, 0.2), (40, 0.5), (100, 0.5), (400, 0.5), (400, 0.05)] {
        let held = held(n, 3.5, s, 3.0);
        assert!(held.iter().all(|held| (463..=500).contains(held)), "{n} trials, s = {s}: {held:?}");
    }
}
