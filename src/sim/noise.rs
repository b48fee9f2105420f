//! The noise of sensors as a function of random stream, tick, sensor and channel.

use super::{NoiseDraw, Normal, Sensor};
use rand::{RngExt, rngs::ChaCha8Rng};
use rand_distr::StandardNormal;

/// Standard normal numbers from a random stream, in which each sensor has a place of its own at every tick.
pub struct Normals(pub ChaCha8Rng);

/// Room for sensors, and for the words that the numbers of one sensor take, as powers of 2. A number takes two words or,
/// rarely, some more.
const SENSORS_LOG2: u32 = 6;
const WORDS_LOG2: u32 = 12;

impl Normal for Normals {
    fn draw(&self, when: NoiseDraw, sensor: Sensor, channels: &mut [f64]) {
        let moment = match when {
            NoiseDraw::Bias => 0,
            NoiseDraw::Tick(tick) => u128::from(tick) + 1,
        };
        let mut rng = ChaCha8Rng::deserialize_state(&self.0.serialize_state());
        rng.set_word_pos((moment << SENSORS_LOG2 | sensor as u128) << WORDS_LOG2);
        for channel in channels {
            *channel = rng.sample(StandardNormal);
        }
    }
}
