use super::*;
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

fn steep() -> Vec<(f64, bool)> {
    (1..=60)
        .map(|i| (0.1 * i as f64, i < 27 || [29, 30, 33].contains(&i)))
        .collect()
}

fn flat() -> Vec<(f64, bool)> {
    (0..80)
        .map(|i| (1.0 + 0.05 * i as f64, (i * 37) % 100 + i < 110))
        .collect()
}

fn outcomes(recovered: &[f64], fell: &[f64]) -> Vec<(f64, bool)> {
    recovered
        .iter()
        .map(|&x| (x, true))
        .chain(fell.iter().map(|&x| (x, false)))
        .collect()
}

fn close(found: f64, expected: f64) {
    assert!((found - expected).abs() < 2e-7, "{found} is not {expected}");
}

fn level_is(level: Option<Level>, (at, ci95): (f64, [Option<f64>; 2])) {
    let level = level.unwrap();
    close(level.at, at);
    for (found, expected) in level.ci95.into_iter().zip(ci95) {
        assert_eq!(found.is_some(), expected.is_some(), "{level:?}");
        close(found.unwrap_or_default(), expected.unwrap_or_default());
    }
}

// Expected values: fits of statsmodels 0.15.0 `GLM(family=Binomial())`; ends of intervals by brentq of scipy 1.17.1 on
// the likelihood, maximised over the slope by `minimize_scalar` from a grid.
#[test]
#[rustfmt::skip]
fn fit_intervals_and_bands_are_those_of_others() {
    for (trials, x50, s, at50, at90, bands) in [
        (steep(), 2.949999755175256, 0.21995903575536807,
            [Some(2.5510895226026147), Some(3.348876198810404)],
            (2.466700355806385, [Some(1.6354613279531072), Some(2.8931174366207975)]),
            &[(2.0, [0.8051784338263148, 0.9999793958304143]), (3.0, [0.10444086205540729, 0.8184644980413335]),
                (4.5, [3.2619524564905315e-08, 0.06420746542418596])][..]),
        (flat(), 4.040627173852578, 0.9518502044441804,
            [Some(3.5270888447616864), None],
            (1.9491985107053198, [None, Some(2.6824956114417375)]),
            &[(1.5, [0.8295043494336533, 0.982691477422309]), (4.9, [0.1283845418179804, 0.5096981051407421])]),
        // Six trials bound little.
        (outcomes(&[1.0, 2.0, 3.5], &[3.0, 4.0, 5.0]), 3.162617337568636, 0.505712,
            [None, None],
            (2.051454818747205, [None, Some(3.547474908075821)]),
            &[(3.2, [0.024151327459323843, 0.9742810470974905])]),
        // A step is put midway and bounded all the same.
        (outcomes(&[1.0, 2.0, 2.5, 1.5], &[4.0, 4.5, 6.0, 5.0]), 3.25, 0.0,
            [Some(1.8036188625636635), Some(4.7557234140294655)],
            (3.25, [None, Some(4.063734670570543)]),
            &[(2.0, [0.4242387982000711, 1.0]), (3.2, [0.0, 1.0]), (4.8, [0.0, 0.4871134328138614])]),
        // It may lie at an impulse that ends either way.
        (outcomes(&[1.0, 1.5, 2.0, 3.0, 3.0, 3.0], &[3.0, 3.0, 4.0, 5.0, 4.5, 6.0]), 3.0, 0.0,
            [Some(1.9502960947269694), Some(4.498045079645667)],
            (3.0, [None, Some(3.1701938305720034)]),
            &[(2.0, [0.4901279334543888, 1.0]), (3.0, [0.1318627469987206, 0.9554927893486381]),
                (4.0, [0.0, 0.6106034489444582])]),
    ] {
        let pushes = Pushes::new(&trials);
        let curve = pushes.curve().unwrap();
        close(curve.x50, x50);
        assert!((curve.s - s).abs() < 1e-6, "{}", curve.s);
        level_is(curve.impulse50, (x50, at50));
        level_is(curve.impulse90, at90);
        for (x, band) in bands {
            for (end, expected) in pushes.band(*x).into_iter().zip(band) {
                close(end, *expected);
            }
        }
        assert_eq!([(curve.recovered, true), (curve.trials - curve.recovered, false)]
            .map(|(count, end)| trials.iter().filter(|trial| trial.1 == end).count() as u64 - count), [0, 0]);
        let beside = s * 9f64.ln() + f64::from(s == 0.0);
        let chances = if s == 0.0 { [1.0, 0.5, 0.0] } else { [0.9, 0.5, 0.1] };
        for (side, expected) in [-1.0, 0.0, 1.0].into_iter().zip(chances) {
            assert!((curve.chance(curve.x50 + side * beside) - expected).abs() < 1e-5);
        }
    }
}

#[test]
fn without_a_curve_there_is_a_reason() {
    for (recovered, fell, reason) in [
        (&[][..], &[][..], NoCurve::NoTrials),
        (&[1.0, 2.0], &[], NoCurve::AllRecovered),
        (&[], &[1.0, 1.0], NoCurve::NoneRecovered),
        (&[2.0], &[2.0, 2.0], NoCurve::OneImpulse),
        (&[2.0, 3.0], &[1.0, 2.0], NoCurve::NotFalling),
        (&[1.0, 3.0, 4.0], &[1.0, 2.0, 2.5], NoCurve::NotFalling),
    ] {
        let pushes = Pushes::new(&outcomes(recovered, fell));
        assert_eq!(
            (pushes.curve(), pushes.band(2.0)),
            (Err(reason), [0.0, 1.0])
        );
    }
}

#[test]
fn no_push_supports_a_level_outside_of_their_range() {
    // Recovery from 95, 90 and 80 % of 20 pushes each, and the same with falls.
    let weak: Vec<_> = [(1.0, 1), (2.0, 2), (3.0, 4)]
        .into_iter()
        .flat_map(|(x, fell)| (0..20).map(move |i| (x, i >= fell)))
        .collect();
    let curve = Pushes::new(&weak).curve().unwrap();
    assert_eq!(
        (curve.range, curve.impulse50, curve.no_impulse50),
        ([1.0, 3.0], None, Some(NoCurve::AboveRange))
    );
    assert!(curve.impulse90.is_some() && curve.no_impulse90.is_none() && curve.x50 > 3.0);
    let hard: Vec<_> = weak
        .iter()
        .map(|&(x, recovered)| (4.0 - x, !recovered))
        .collect();
    let curve = Pushes::new(&hard).curve().unwrap();
    assert_eq!(
        (curve.no_impulse50, curve.no_impulse90),
        (Some(NoCurve::BelowRange), Some(NoCurve::BelowRange))
    );
}

#[test]
fn neither_unit_nor_order_nor_mirror_matters() {
    let curve = Pushes::new(&flat()).curve().unwrap();
    let scaled: Vec<_> = flat()
        .iter()
        .rev()
        .map(|&(x, recovered)| (1e-3 * x, recovered))
        .collect();
    let small = Pushes::new(&scaled).curve().unwrap();
    close(1e3 * small.x50, curve.x50);
    close(
        1e3 * small.impulse90.unwrap().ci95[1].unwrap(),
        curve.impulse90.unwrap().ci95[1].unwrap(),
    );
    let mirrored: Vec<_> = flat()
        .iter()
        .map(|&(x, recovered)| (10.0 - x, !recovered))
        .collect();
    let Level {
        at,
        ci95: [low, high],
    } = curve.impulse50.unwrap();
    level_is(
        Pushes::new(&mirrored).curve().unwrap().impulse50,
        (10.0 - at, [high, low].map(|x| Some(10.0 - x?))),
    );
}

/// Of 500 simulated campaigns each, how many intervals of x50 and of x90, and of bands at 3, contain the truth.
#[test]
fn intervals_hold_at_95_percent() {
    let (x50, x) = (3.5, 3.0);
    for (n, s) in [
        (40, 0.02),
        (40, 0.2),
        (40, 0.5),
        (100, 0.5),
        (400, 0.5),
        (400, 0.05),
    ] {
        let (mut rng, mut held) = (ChaCha8Rng::seed_from_u64(n), [0; 3]);
        let truth = |x: f64| chance((x50 - x) / s);
        for _ in 0..500 {
            let mut trial = || {
                let x = 6.0 * rng.random::<f64>();
                (x, rng.random::<f64>() < truth(x))
            };
            let pushes = Pushes::new(&(0..n).map(|_| trial()).collect::<Vec<_>>());
            let curve = pushes.curve().unwrap();
            let [of50, of90] = [curve.impulse50, curve.impulse90].map(|level| level.unwrap().ci95);
            for (i, (interval, truth)) in [
                (of50, x50),
                (of90, x50 - s * 9f64.ln()),
                (pushes.band(x).map(Some), truth(x)),
            ]
            .into_iter()
            .enumerate()
            {
                let [low, high] = interval;
                held[i] += u64::from(
                    low.is_none_or(|low| low <= truth) && high.is_none_or(|high| truth <= high),
                );
            }
        }
        assert!(
            held.iter().all(|held| (463..=500).contains(held)),
            "{n} trials, s = {s}: {held:?}"
        );
    }
}
