//! A shard is the share of one machine in the trials of a campaign.

use std::fmt;
use std::str::FromStr;

/// Shard `index` of `count`, from 1: the blocks b with b mod count = index - 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    pub index: u64,
    pub count: u64,
}

impl Shard {
    pub fn takes(self, block: u64) -> bool {
        block % self.count == self.index - 1
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}

impl FromStr for Shard {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        text.split_once('/')
            .and_then(|(k, n)| {
                Some(Shard {
                    index: k.parse().ok()?,
                    count: n.parse().ok()?,
                })
            })
            .filter(|s| (1..=s.count).contains(&s.index))
            .ok_or_else(|| "expected k/n with 1 <= k <= n, e.g. 1/4".into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_take_every_block_once() {
        let shards: Vec<Shard> = (1..=3).map(|k| format!("{k}/3").parse().unwrap()).collect();
        for block in 0..10 {
            assert_eq!(shards.iter().filter(|s| s.takes(block)).count(), 1);
        }
        for bad in ["", "1", "0/3", "4/3", "a/3", "1/0", "-1/3"] {
            assert!(bad.parse::<Shard>().is_err(), "{bad}");
        }
    }
}
