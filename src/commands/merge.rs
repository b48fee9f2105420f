//! `standfast merge`: joins the parts of a campaign that was run in shards to its result.

use super::arguments::{GateArgs, ReplaysArgs};
use super::interrupt::stop_on_ctrl_c;
use super::result::{Printing, Told, conclude, exit_code, gates_of};
use super::terminal::{note, warn};
use standfast_core::error::{Error, Result};
use standfast_report::text::next_command;
use standfast_study::Folder;
use standfast_study::store::claim::{Access, Claim};
use standfast_study::until_resolved::UntilResolved;
use std::path::PathBuf;
use std::process::ExitCode;

#[derive(Debug, clap::Args)]
#[command(
    after_help = "The exit code is 3 if parts are missing or cannot be, or if a trial that is
simulated again for its replay does not end as its part says.

For its replays, a controller that is a program is started out of the result's
folder. If this machine has not made its files, you are asked first; where there
is no terminal, --run-inputs allows it, and --replays 0 does without."
)]
pub struct MergeArgs {
    /// Result folder of `run`, with the parts of all shards
    pub dir: PathBuf,
    #[command(flatten)]
    pub gates: GateArgs,
    #[command(flatten)]
    pub replays: ReplaysArgs,
    /// Write the rows alone to a new folder, as a baseline without files of robot and controllers
    #[arg(long, value_name = "DIR")]
    pub pack: Option<PathBuf>,
    #[command(flatten)]
    pub printing: Printing,
}

pub fn run(args: &MergeArgs) -> Result<ExitCode> {
    let mut folder = Folder::existing(&args.dir)?;
    folder.refuse_packed("merged again")?;
    folder.manifest.campaign.gates.add(&args.gates.gate);
    let gates = gates_of(&folder, &args.gates)?;
    let _claim = Claim::of(&folder, Access::Exclusive, || Ok(()))?;
    stop_on_ctrl_c();
    let builds = folder.builds().len();
    if builds > 1 {
        let advice = "To have all from one, run the campaign with it and a new --out.";
        warn(
            "",
            &format!(
                "The parts were made by {builds} builds of standfast, whose trials may differ. {advice}"
            ),
        );
    }
    // The shards of a campaign that ends when decided may have left the looks to the merge; what the shards say is
    // looked at again.
    if let Some(mut looks) = UntilResolved::new(&folder, &gates) {
        looks.go_on(&|_| {})?;
        if looks.is_over {
            folder.stop_at(&looks.controller_trials)?;
        } else if folder.has_stopped() && folder.missing().is_empty() {
            // The campaign has ended for another question.
            return Err(next_command::undecided(&folder, &args.gates.gate));
        }
    }
    folder.create()?;
    if let Some(to) = &args.pack {
        folder.pack(to)?;
        note(&format!("written: {}", to.display()));
    }
    let baseline = args.gates.packed_baseline()?;
    let told = Told {
        printing: args.printing,
        baseline: baseline.as_ref(),
    };
    let (summary, differ) = conclude(&folder, &gates, &args.replays, Some(told), true)?;
    if differ.is_empty() {
        return Ok(exit_code(&[summary]));
    }
    // Each trial that differs was told when its page was written.
    let problem = format!(
        "the result was written, but {} of the trials that were simulated again do not end as its parts say",
        differ.len()
    );
    Err(Error::Parts {
        path: folder.path,
        problem,
    })
}
