//! Success against impulse: a logistic curve through trials, and the impulses with 50 % and with 90 % recovery.
//!
//! The curve `P(recovered at x) = 1 / (1 + exp((x - x50) / s))`, with the impulse x, is fitted by maximum likelihood
//! (Newton's method). Every interval is from the profile likelihood: it contains each value for which the likelihood,
//! with the best slope for that value, is smaller than that of the best curve by at most the factor `exp(-3.841 / 2)`
//! (chi-squared with 1 degree of freedom at 95 %; Venzon and Moolgavkar 1988, "A method for computing
//! profile-likelihood-based confidence intervals"). A curve through a given point (t, p) is
//! `logit P = logit p - b (x - t)`, with b >= 0 as the only unknown. So the same search gives the impulse at a given
//! success and the band of success at a given impulse: x is in the interval of x50 exactly if the band at x contains 50
//! %.
//! If every push with recovery is weaker than every push without, the likeliest curve is a step (s = 0) anywhere
//! between the two neighbours. It is put midway, for 50 % and 90 % alike, and the profile likelihood bounds it in the
//! same way. Firth's penalty, the usual remedy, would give the step a width that comes from the penalty and not from
//! the trials. The interval of x90 then contained the truth in only 80 % of simulated cases (40 trials over 6 N s, s =
//! 0.02 N s).
//!
//! With fewer than 10 trials between the weakest push without recovery and the hardest with recovery, 3.841 is not
//! enough: intervals contained the truth in 85 % of some cases. There the slope is as uncertain as the position, so
//! chi-squared with 2 degrees of freedom (5.991) is used. Of 1000 simulated intervals over 6 N s, 94 to 97 % then
//! contained the truth (40 trials with s of 0.2 and 0.5 N s, 100 with 0.5, 400 with 0.05 and 0.5, 1000 with 1); with 40
//! trials and s = 0.02, more than 99 %.
//!
//! x is in any unit, such as N s or the impulse as a share of `m omega d`, the same for all trials.

use serde::Serialize;

/// Values that chi-squared with 1 and with 2 degrees of freedom exceeds with 5 % probability.
const CHI2_95: [f64; 2] = [3.841_458_820_694_124, 5.991_464_547_107_979];
/// Number of trials between the weakest push without recovery and the hardest with recovery below which they count as
/// few.
const FEW: f64 = 10.0;
/// Change of the likelihood below which searches end.
const NEGLIGIBLE: f64 = 1e-11;
/// Logit beyond which a probability counts as 0 or 1.
const CERTAIN: f64 = 36.0;
/// Distance from the centre of a step at which searches start, as a share of half the range of impulses.
const HAIR: f64 = 1e-9;
/// Accuracy of the ends of intervals, in half ranges or logits, and largest number of iterations.
const PRECISE: f64 = 1e-9;
const MAX_TRIALS: u32 = 100;

/// The reason why there is no curve, or no impulse for a given success.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, thiserror::Error)]
#[serde(rename_all = "snake_case")]
pub enum NoCurve {
    #[error("no trials")]
    NoTrials,
    #[error("one impulse only")]
    OneImpulse,
    #[error("all recovered")]
    AllRecovered,
    #[error("none recovered")]
    NoneRecovered,
    #[error("success does not fall with impulse")]
    NotFalling,
    /// The success is lower than required even at the weakest push.
    #[error("under the weakest")]
    BelowRange,
    /// The success is higher than required even at the hardest push.
    #[error("over the hardest")]
    AboveRange,
}

/// The impulse with a given success.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Level {
    pub at: f64,
    /// 95 % interval. An end is None if the trials give no bound within the range of their impulses.
    pub ci95: [Option<f64>; 2],
}

/// A fitted curve; impulses in the unit of the trials.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SuccessCurve {
    pub trials: u64,
    pub recovered: u64,
    /// Impulses of the weakest and the hardest push.
    pub range: [f64; 2],
    /// Parameter of the curve: the impulse with 50 % success. It may lie outside of `range`.
    pub x50: f64,
    /// Parameter of the curve: the distance from 50 % to 27 % (or 73 %) success; 0 for a step.
    pub s: f64,
    /// Impulse with 50 % success; None outside of `range`.
    pub impulse50: Option<Level>,
    /// Impulse with 90 % success; None outside of `range`.
    pub impulse90: Option<Level>,
    /// Why `impulse50` is None.
    pub no_impulse50: Option<NoCurve>,
    /// Why `impulse90` is None.
    pub no_impulse90: Option<NoCurve>,
}

impl SuccessCurve {
    /// Probability to recover at the impulse `x`.
    pub fn chance(&self, x: f64) -> f64 {
        if x == self.x50 {
            0.5
        } else {
            1.0 / (1.0 + ((x - self.x50) / self.s).exp())
        }
    }
}

/// Trials, counted by impulse, with the likeliest curve through them.
#[derive(Debug, Clone, PartialEq)]
pub struct Pushes {
    /// Middle and half width of the range. Places are impulses relative to this range, from -1 to 1.
    middle: f64,
    half: f64,
    /// Impulses of the weakest and the hardest push.
    range: [f64; 2],
    /// Place, number of pushes with recovery and number without, in ascending order of place.
    places: Vec<(f64, f64, f64)>,
    best: Result<Best, NoCurve>,
}

/// The likeliest curve: `logit P = slope (centre - place)`.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Best {
    centre: f64,
    /// Infinite for a step.
    slope: f64,
    /// Logit at the centre. It is 0, except for a step at which pushes of one impulse ended in both ways.
    at_centre: f64,
    ln_likelihood: f64,
    /// Value that twice the logarithm of a likelihood ratio exceeds with 5 % probability.
    chi2_95: f64,
    /// Variances of intercept and slope, and their covariance, from which the ends of intervals are estimated; 0 for a
    /// step.
    covariance: [f64; 3],
}

impl Pushes {
    /// Counts trials, each given by its impulse (finite, all in one unit) and by whether the robot recovered.
    pub fn new(trials: &[(f64, bool)]) -> Self {
        let mut sorted = trials.to_vec();
        sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
        let [least, most] =
            [sorted.first(), sorted.last()].map(|trial| trial.map_or(0.0, |trial| trial.0));
        let (middle, half) = (0.5 * (least + most), 0.5 * (most - least));
        let mut places = Vec::new();
        for same in sorted.chunk_by(|a, b| a.0 == b.0) {
            let recovered = same.iter().filter(|trial| trial.1).count();
            places.push((
                (same[0].0 - middle) / half,
                recovered as f64,
                (same.len() - recovered) as f64,
            ));
        }
        Self {
            middle,
            half,
            range: [least, most],
            best: likeliest(&places),
            places,
        }
    }

    /// The likeliest curve, with the impulses at which it falls to 90 % and to 50 %.
    pub fn curve(&self) -> Result<SuccessCurve, NoCurve> {
        let best = self.best?;
        let [recovered, fell] = counts(&self.places);
        let (at50, at90) = (self.level(&best, 0.0), self.level(&best, 9f64.ln()));
        Ok(SuccessCurve {
            trials: (recovered + fell) as u64,
            recovered: recovered as u64,
            range: self.range,
            x50: self.impulse(best.centre),
            s: self.half / best.slope,
            impulse50: at50.ok(),
            impulse90: at90.ok(),
            no_impulse50: at50.err(),
            no_impulse90: at90.err(),
        })
    }

    /// The impulse at which the likeliest curve falls to this probability (above 0, below 1).
    pub fn at(&self, chance: f64) -> Result<Level, NoCurve> {
        let best = self.best?;
        self.level(&best, (chance / (1.0 - chance)).ln())
    }

    /// 95 % interval of the probability to recover at the impulse `x`, for this x alone; 0 to 1 if there is no curve.
    /// Beyond the range of impulses it is an extrapolation. It takes some tens of passes over the trials.
    pub fn band(&self, x: f64) -> [f64; 2] {
        let Ok(best) = self.best else {
            return [0.0, 1.0];
        };
        let place = (x - self.middle) / self.half;
        let logit = best.logit(place);
        [-CERTAIN, CERTAIN].map(|certain| {
            let end = crossing(
                |logit| self.unlikeliness(&best, place, logit),
                logit,
                certain,
                best.deviation(place),
            );
            chance(end.unwrap_or(certain * f64::INFINITY))
        })
    }

    fn impulse(&self, place: f64) -> f64 {
        self.middle + self.half * place
    }

    /// The impulse at which a curve has this logit, with its interval.
    fn level(&self, best: &Best, logit: f64) -> Result<Level, NoCurve> {
        let place = best.place(logit);
        if place < -1.0 {
            return Err(NoCurve::BelowRange);
        } else if place > 1.0 {
            return Err(NoCurve::AboveRange);
        }
        let deviation = best.deviation(place) / best.slope;
        // A step is put at its centre, but its search starts beside it.
        let at = if best.slope.is_finite() {
            place
        } else {
            best.centre
        };
        Ok(Level {
            at: self.impulse(at),
            ci95: [-1.0, 1.0].map(|end| {
                let unlikely = |place: f64| self.unlikeliness(best, place, logit);
                crossing(unlikely, place, end, deviation).map(|place| self.impulse(place))
            }),
        })
    }

    /// How much less likely the likeliest falling curve through (place, logit) is than the best curve. It is positive
    /// outside of the 95 % interval. It is a root of twice the logarithm of the ratio, about linear in the place.
    fn unlikeliness(&self, best: &Best, place: f64, logit: f64) -> f64 {
        let start = if best.slope.is_finite() {
            best.slope
        } else {
            0.0
        };
        let less = best.ln_likelihood - likeliest_through(&self.places, place, logit, start);
        (2.0 * less.max(0.0)).sqrt() - best.chi2_95.sqrt()
    }
}

impl Best {
    fn logit(&self, place: f64) -> f64 {
        if place == self.centre {
            self.at_centre
        } else {
            (self.slope * (self.centre - place)).clamp(-CERTAIN, CERTAIN)
        }
    }

    /// Places the values of a step, other than the centre's, just beside the centre, on one side or the other.
    fn place(&self, logit: f64) -> f64 {
        let beside = if logit > self.at_centre { HAIR } else { -HAIR };
        self.centre
            - if self.slope.is_finite() {
                logit / self.slope
            } else {
                beside
            }
    }

    /// Standard deviation of the logit.
    fn deviation(&self, place: f64) -> f64 {
        let [intercept, slope, both] = self.covariance;
        (intercept + place * place * slope - 2.0 * place * both)
            .max(0.0)
            .sqrt()
    }
}

fn counts(places: &[(f64, f64, f64)]) -> [f64; 2] {
    places.iter().fold([0.0; 2], |[recovered, fell], place| {
        [recovered + place.1, fell + place.2]
    })
}

fn likeliest(places: &[(f64, f64, f64)]) -> Result<Best, NoCurve> {
    let [recovered, fell] = counts(places);
    if places.is_empty() {
        return Err(NoCurve::NoTrials);
    } else if fell == 0.0 {
        return Err(NoCurve::AllRecovered);
    } else if recovered == 0.0 {
        return Err(NoCurve::NoneRecovered);
    } else if places.len() == 1 {
        return Err(NoCurve::OneImpulse);
    }
    let hardest = places
        .iter()
        .rfind(|place| place.1 > 0.0)
        .unwrap_or(&places[0]);
    let weakest = places
        .iter()
        .find(|place| place.2 > 0.0)
        .unwrap_or(&places[0]);
    let overlapping = places
        .iter()
        .filter(|place| weakest.0 <= place.0 && place.0 <= hardest.0);
    let few = overlapping.map(|place| place.1 + place.2).sum::<f64>() < FEW;
    let chi2_95 = CHI2_95[usize::from(few)];
    if hardest.0 <= weakest.0 {
        let mixed = hardest.0 == weakest.0;
        let at_centre = if mixed {
            (weakest.1 / weakest.2).ln()
        } else {
            0.0
        };
        let ln_likelihood = if mixed {
            ln_likelihood(&[*weakest], |_| at_centre)
        } else {
            0.0
        };
        let centre = 0.5 * (hardest.0 + weakest.0);
        return Ok(Best {
            centre,
            slope: f64::INFINITY,
            at_centre,
            ln_likelihood,
            chi2_95,
            covariance: [0.0; 3],
        });
    }
    // Outcomes overlap, so the likelihood has one maximum (Albert and Anderson 1984), which is at infinity only if
    // success rises in a step. Newton's steps lead towards it; they are halved as long as they lead down.
    let likelihood = |a: f64, b: f64| ln_likelihood(places, |place| a - b * place);
    let (mut a, mut b) = ((recovered / fell).ln(), 0.0);
    let mut value = likelihood(a, b);
    let covariance = loop {
        // Gradient and negative Hessian, with respect to intercept and slope.
        let (mut ga, mut gb, mut haa, mut hab, mut hbb) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for &(x, recovered, fell) in places {
            let p = chance(a - b * x);
            let residual = recovered * (1.0 - p) - fell * p;
            let weight = (recovered + fell) * p * (1.0 - p);
            ga += residual;
            gb -= x * residual;
            haa += weight;
            hab -= x * weight;
            hbb += x * x * weight;
        }
        let determinant = haa * hbb - hab * hab;
        let step = [
            (hbb * ga - hab * gb) / determinant,
            (haa * gb - hab * ga) / determinant,
        ];
        let mut share = 1.0;
        let next = loop {
            let next = likelihood(a + share * step[0], b + share * step[1]);
            if next >= value || share < NEGLIGIBLE {
                break next;
            }
            share *= 0.5;
        };
        // The value is not higher, or it is NaN because the trials hardly distinguish one slope from another.
        if next <= value || next.is_nan() {
            break [hbb / determinant, haa / determinant, -hab / determinant];
        }
        (a, b, value) = (a + share * step[0], b + share * step[1], next);
    };
    if b <= 0.0 {
        return Err(NoCurve::NotFalling);
    }
    Ok(Best {
        centre: a / b,
        slope: b,
        at_centre: 0.0,
        ln_likelihood: value,
        chi2_95,
        covariance,
    })
}

/// Log-likelihood of the likeliest curve among those through (place, logit) that do not rise. It is concave in the
/// slope, and the search starts from the slope `start`.
fn likeliest_through(places: &[(f64, f64, f64)], place: f64, logit: f64, start: f64) -> f64 {
    let (mut slope, mut low, mut high) = (start, -1.0, f64::INFINITY);
    loop {
        let (mut value, mut gradient, mut curvature) = (0.0, 0.0, 0.0);
        for &(x, recovered, fell) in places {
            let (z, n) = (x - place, recovered + fell);
            let eta = logit - slope * z;
            // One exponential serves for probability and logarithms, since most of the time is spent here.
            let small = (-eta.abs()).exp();
            let (more, less) = (1.0 / (1.0 + small), small / (1.0 + small));
            let p = if eta > 0.0 { more } else { less };
            value -= n * small.ln_1p() + if eta > 0.0 { fell } else { recovered } * eta.abs();
            gradient += z * (n * p - recovered);
            curvature += z * z * n * more * less;
        }
        *if gradient > 0.0 { &mut low } else { &mut high } = slope;
        let step = gradient / curvature;
        // If the trials do not bound the slope, the likelihood levels off.
        if (slope == 0.0 && gradient <= 0.0)
            || curvature == 0.0 && gradient.abs() < NEGLIGIBLE
            || gradient * step < NEGLIGIBLE
        {
            return value;
        }
        // Newton's step, limited to not far beyond the last slope. If it leaves the bracket, the bracket is bisected.
        let newton = (slope + step).max(0.0).min(2.0 * slope + 8.0);
        slope = if newton > low && newton < high {
            newton
        } else {
            0.5 * (low.max(0.0) + high)
        };
        if slope == low || slope == high {
            return value;
        }
    }
}

fn chance(logit: f64) -> f64 {
    1.0 / (1.0 + (-logit).exp())
}

fn ln_likelihood(places: &[(f64, f64, f64)], logit: impl Fn(f64) -> f64) -> f64 {
    // ln(1 + e^x) without overflow.
    let softplus = |x: f64| x.max(0.0) + (-x.abs()).exp().ln_1p();
    -places
        .iter()
        .map(|&(x, recovered, fell)| recovered * softplus(-logit(x)) + fell * softplus(logit(x)))
        .sum::<f64>()
}

/// The place where `f` rises through 0 between `inside` (at most 0) and `outside`, about two `deviation`s away. It is
/// None if there is no such place.
fn crossing(f: impl Fn(f64) -> f64, inside: f64, outside: f64, deviation: f64) -> Option<f64> {
    let mut low = (inside, f(inside));
    let mut reach = 1.96 * deviation * (outside - inside).signum();
    // The search goes outwards from a guess, because far outside the search for the likeliest slope takes long.
    let mut high = loop {
        let guess = inside + reach;
        let x = if (guess - inside) * (guess - outside) < 0.0 {
            guess
        } else {
            outside
        };
        let y = f(x);
        if y > 0.0 {
            break (x, y);
        } else if x == outside {
            return None;
        }
        low = (x, y);
        reach *= 1.25;
    };
    let mut x = high.0;
    for trial in 0..MAX_TRIALS {
        x = low.0 - low.1 * (high.0 - low.0) / (high.1 - low.1);
        // Likelihoods may jump, so every third iteration bisects.
        if trial % 3 == 2 || (x - low.0) * (x - high.0) >= 0.0 {
            x = 0.5 * (low.0 + high.0);
        }
        let y = f(x);
        *if y > 0.0 { &mut high } else { &mut low } = (x, y);
        if y.abs() < PRECISE || (high.0 - low.0).abs() < PRECISE {
            break;
        }
    }
    Some(x)
}

#[cfg(test)]
mod tests;
