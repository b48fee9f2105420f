//! Claims a result folder. A claim is a lock on `parts/.lock`. The lock ends when the program that holds it ends, in
//! whatever way.
//!
//! Shards of one campaign share a folder. A whole run or a merge has it alone, because it decides what the result is.
//! Two different campaigns never get it at the same time: the second one finds the manifest of the first. If a file
//! system has no locks, only the manifest guards the folder, and it is read again before each part is written.

use crate::store::folder::Folder;
use crate::store::manifest::Manifest;
use standfast_core::error::{Error, Result};
use standfast_files::is_no_file;
use std::fs::{self, File, TryLockError};
use std::time::{Duration, Instant};

/// Longest time that a shard waits for another shard that is writing the manifest.
const PATIENCE: Duration = Duration::from_secs(20);

/// Who may work in a folder while it is claimed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Access {
    /// Only the program that claims it.
    Exclusive,
    /// All shards of one campaign.
    SharedByShards,
}

/// As long as this value lives, no other program may change the folder.
#[derive(Debug)]
pub struct Claim {
    /// None if the file system has no locks.
    _lock: Option<File>,
}

impl Claim {
    /// Claims a folder. If no other program works there, it calls `begin`, which writes the manifest. It fails if
    /// another program must not be disturbed, or if the folder belongs to another campaign.
    pub fn of(folder: &Folder, access: Access, begin: impl Fn() -> Result<()>) -> Result<Self> {
        let path = folder.path.join("parts/.lock");
        let fail = |source| Error::Write {
            path: path.clone(),
            source,
        };
        fs::create_dir_all(folder.path.join("parts")).map_err(fail)?;
        if is_no_file(&path) {
            return Err(fail(std::io::Error::other("it is no file")));
        }
        let lock = File::options()
            .create(true)
            .append(true)
            .open(&path)
            .map_err(fail)?;
        let since = Instant::now();
        let ours = || match Manifest::stated_hash(&folder.path) {
            Some(_) => folder.check_owner(),
            None => Ok(()),
        };
        loop {
            match lock.try_lock() {
                Ok(()) => {
                    ours()?;
                    folder.remove_unfinished()?;
                    begin()?;
                    if access == Access::Exclusive {
                        return Ok(Self { _lock: Some(lock) });
                    }
                    lock.unlock().map_err(fail)?;
                }
                Err(TryLockError::WouldBlock) if access == Access::Exclusive => {
                    return Err(Error::Busy(folder.path.clone()));
                }
                Err(TryLockError::WouldBlock) => {}
                Err(TryLockError::Error(error)) => {
                    let advice = "run one command at a time in this folder";
                    log::warn!(
                        "{}: the file system has no locks ({error}); {advice}",
                        path.display()
                    );
                    ours()?;
                    begin()?;
                    return Ok(Self { _lock: None });
                }
            }
            // From here on other shards may be at work, so the manifest is not written any more.
            if lock.try_lock_shared().is_ok() {
                if Manifest::stated_hash(&folder.path).is_some() {
                    folder.check_same_manifest()?;
                    return Ok(Self { _lock: Some(lock) });
                }
                lock.unlock().map_err(fail)?;
            }
            if since.elapsed() > PATIENCE {
                return Err(Error::Busy(folder.path.clone()));
            }
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

impl Folder {
    /// Fails if the folder no longer belongs to this campaign.
    pub fn check_owner(&self) -> Result<()> {
        let problem = match Manifest::stated_hash(&self.path) {
            Some(hash) if hash == self.manifest.config_hash => return Ok(()),
            Some(_) => "has been taken by another campaign; give each its own --out",
            None => "its manifest (parts/campaign.json) has disappeared",
        };
        Err(Error::Parts {
            path: self.path.clone(),
            problem: problem.into(),
        })
    }

    /// Fails if the manifest in the folder, which the shards at work there use, differs from this one: other trials, or
    /// other gates.
    fn check_same_manifest(&self) -> Result<()> {
        if Manifest::read(&self.path)? == self.manifest {
            return Ok(());
        }
        let problem = "others are at work in this folder, with another campaign or with other gates; give another --out";
        Err(Error::Parts {
            path: self.path.clone(),
            problem: problem.into(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::folder::tests::folder;

    fn claim(folder: &Folder, access: Access) -> Result<Claim> {
        Claim::of(folder, access, || folder.create())
    }

    #[test]
    fn a_whole_run_is_alone_and_shards_are_not() {
        let dir = tempfile::tempdir().unwrap();
        let folder = folder(dir.path());
        let exclusive = claim(&folder, Access::Exclusive).unwrap();
        assert!(matches!(
            claim(&folder, Access::Exclusive),
            Err(Error::Busy(_))
        ));
        drop(exclusive);
        let shards = [
            claim(&folder, Access::SharedByShards).unwrap(),
            claim(&folder, Access::SharedByShards).unwrap(),
        ];
        assert!(matches!(
            claim(&folder, Access::Exclusive),
            Err(Error::Busy(_))
        ));
        let mut other = folder.clone();
        other.manifest.campaign.stopping.margin = 0.1;
        let message = claim(&other, Access::SharedByShards)
            .unwrap_err()
            .to_string();
        assert!(message.contains("other gates"), "{message}");
        drop(shards);
        // A program that is alone may apply other gates to the same trials.
        assert!(
            claim(&other, Access::SharedByShards).is_ok()
                && claim(&folder, Access::Exclusive).is_ok()
        );
        assert!(folder.check_owner().is_ok());
        other.manifest.config_hash = "another".into();
        for access in [Access::Exclusive, Access::SharedByShards] {
            let message = claim(&other, access).unwrap_err().to_string();
            assert!(message.contains("another campaign"), "{message}");
        }
        std::fs::remove_file(dir.path().join("parts/campaign.json")).unwrap();
        assert!(
            folder
                .check_owner()
                .unwrap_err()
                .to_string()
                .contains("disappeared")
        );
    }
}
