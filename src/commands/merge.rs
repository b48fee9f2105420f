//! `standfast merge`: the parts of a campaign that was run in shards become its result.

use super::arguments::{GateArgs, ReplaysArgs};
use super::interrupt::stop_on_ctrl_c;
use super::result::{conclude, gates_of};
use super::status::FolderArgs;
use crate::campaign::Folder;
use crate::error::Result;
use std::process::ExitCode;

#[derive(Debug, clap::Args)]
pub struct MergeArgs {
    #[command(flatten)]
    pub folder: FolderArgs,
    #[command(flatten)]
    pub gates: GateArgs,
    #[command(flatten)]
    pub replays: ReplaysArgs,
}

pub fn run(args: &MergeArgs) -> Result<ExitCode> {
    let mut folder = Folder::existing(&args.folder.dir)?;
    folder.manifest.campaign.gates.add(&args.gates.gate);
    let gates = gates_of(&folder, &args.gates)?;
    folder.create()?;
    stop_on_ctrl_c();
    conclude(&folder, &gates, &args.replays, args.folder.json)
}
