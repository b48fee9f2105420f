//! A claim on a result folder: a lock that a running program holds on `parts/.lock`, and that ends with the program,
//! however it ends.
//!
//! Shards of one campaign share a folder. A whole run or a merge has it for itself, since it decides what the result is.
//! Two different campaigns never get it at once: who comes second finds the manifest of the other. Where a file system
//! knows no locks, the manifest alone guards the folder: it is read again before each part is written.

use crate::campaign::store::folder::Folder;
use crate::campaign::store::manifest::Manifest;
use crate::error::{Error, Result};
use std::fs::{self, File, TryLockError};
use std::time::{Duration, Instant};

/// For so long one shard waits for another that is writing the manifest.
const PATIENCE: Duration = Duration::from_secs(20);

/// Who may be at work in a folder beside the one who claims it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Company {
    /// Nobody.
    None,
    /// Shards of the same campaign.
    Shards,
}

/// A folder that nobody else may change, as long as this lives.
#[derive(Debug)]
pub struct Claim {
    /// None where the file system knows no locks.
    _lock: Option<File>,
}

impl Claim {
    /// Claims a folder, and lets `begin` write whose it is if nobody else is at work there. Errors: somebody else is,
    /// or the folder belongs to another campaign.
    pub fn of(folder: &Folder, company: Company, begin: impl Fn() -> Result<()>) -> Result<Self> {
        let path = folder.path.join("parts/.lock");
        let fail = |source| Error::Write { path: path.clone(), source };
        fs::create_dir_all(folder.path.join("parts")).map_err(fail)?;
        if fs::metadata(&path).is_ok_and(|found| !found.is_file()) {
            return Err(fail(std::io::Error::other("it is no file")));
        }
        let lock = File::options().create(true).append(true).open(&path).map_err(fail)?;
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
                    if company == Company::None {
                        return Ok(Self { _lock: Some(lock) });
                    }
                    lock.unlock().map_err(fail)?;
                }
                Err(TryLockError::WouldBlock) if company == Company::None => {
                    return Err(Error::Busy(folder.path.clone()));
                }
                Err(TryLockError::WouldBlock) => {}
                Err(TryLockError::Error(error)) => {
                    let advice = "run one command at a time in this folder";
                    log::warn!("{}: the file system knows no locks ({error}); {advice}", path.display());
                    ours()?;
                    begin()?;
                    return Ok(Self { _lock: None });
                }
            }
            // From here on others may be at work, so the manifest stays as it is.
            if lock.try_lock_shared().is_ok() {
                if Manifest::stated_hash(&folder.path).is_some() {
                    folder.check_company()?;
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
    /// Fails if the folder does not belong to this campaign any more.
    pub fn check_owner(&self) -> Result<()> {
        let found = Manifest::stated_hash(&self.path);
        let problem = match found {
            Some(hash) if hash == self.manifest.config_hash => return Ok(()),
            Some(_) => "has been taken by another campaign; give each its own --out",
            None => "its manifest (parts/campaign.json) has disappeared",
        };
        Err(Error::Parts { path: self.path.clone(), problem: problem.into() })
    }

    /// Whether others that are at work in the folder ask the same: the same trials, and the same of them.
    fn check_company(&self) -> Result<()> {
        if Manifest::read(&self.path)? == self.manifest {
            return Ok(());
        }
        let problem =
            "others are at work in this folder, with another campaign or with other gates; give another --out";
        Err(Error::Parts { path: self.path.clone(), problem: problem.into() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::store::folder::tests::folder;

    fn claim(folder: &Folder, company: Company) -> Result<Claim> {
        Claim::of(folder, company, || folder.create())
    }

    #[test]
    fn a_whole_run_is_alone_and_shards_are_not() {
        let dir = tempfile::tempdir().unwrap();
        let folder = folder(dir.path());
        let alone = claim(&folder, Company::None).unwrap();
        assert!(matches!(claim(&folder, Company::None), Err(Error::Busy(_))));
        drop(alone);
        let shards = [claim(&folder, Company::Shards).unwrap(), claim(&folder, Company::Shards).unwrap()];
        assert!(matches!(claim(&folder, Company::None), Err(Error::Busy(_))));
        let mut other = folder.clone();
        other.manifest.campaign.stopping.margin = 0.1;
        let message = claim(&other, Company::Shards).unwrap_err().to_string();
        assert!(message.contains("other gates"), "{message}");
        drop(shards);
        // Alone, it may ask something else of the same trials.
        assert!(claim(&other, Company::Shards).is_ok() && claim(&folder, Company::None).is_ok());
    }

    #[test]
    fn who_comes_second_with_another_campaign_is_refused() {
        let dir = tempfile::tempdir().unwrap();
        let first = folder(dir.path());
        let mut second = first.clone();
        second.manifest.campaign.seed += 1;
        second.manifest.config_hash = second.manifest.hash().unwrap();
        drop(claim(&first, Company::None).unwrap());
        for company in [Company::None, Company::Shards] {
            let message = claim(&second, company).unwrap_err().to_string();
            assert!(message.contains("another campaign"), "{message}");
        }
        assert!(first.check_owner().is_ok());
        std::fs::remove_file(dir.path().join("parts/campaign.json")).unwrap();
        assert!(first.check_owner().unwrap_err().to_string().contains("disappeared"));
    }
}
