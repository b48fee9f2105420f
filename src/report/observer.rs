//! Observes an episode tick by tick, for its story, its trace and its plot.

use crate::figure::motion::MotionPlot;
use crate::mcap::McapTrace;
use crate::text::story::{EpisodeReport, Witness};
use crate::trace::Trace;
use standfast_core::error::Result;
use standfast_core::robot::Robot;
use standfast_files::columns;
use standfast_sim::episode::{Disturbance, EpisodeRun, Record, Tick};
use standfast_sim::{Push, Variation};
use std::path::{Path, PathBuf};

/// What an episode has shown so far. Trace and plot are kept only if there is a file for them.
pub struct EpisodeObserver<'a> {
    episode: EpisodeRun<'a>,
    pushes: Vec<Push>,
    variation: Variation,
    /// The robot with the variation.
    simulated: Robot,
    witness: Witness,
    mcap: Option<McapTrace<'a>>,
    trace: Option<(PathBuf, Trace)>,
    plot: Option<(PathBuf, MotionPlot)>,
}

impl<'a> EpisodeObserver<'a> {
    /// An observer that will write a trace and a plot to these files.
    pub fn new(
        episode: EpisodeRun<'a>,
        disturbance: &Disturbance,
        trace: Option<&Path>,
        plot: Option<&Path>,
    ) -> Result<Self> {
        let (robot, pushes) = (episode.robot, &disturbance.pushes);
        let is_mcap = trace
            .and_then(Path::extension)
            .is_some_and(|extension| extension == "mcap");
        let (mcap, table) = if is_mcap {
            (trace, None)
        } else {
            (None, trace)
        };
        Ok(Self {
            episode,
            pushes: pushes.clone(),
            variation: disturbance.variation,
            simulated: disturbance.variation.robot(robot),
            witness: Witness::default(),
            mcap: mcap
                .map(|path| McapTrace::create(path, robot))
                .transpose()?,
            trace: table.map(|path| (path.into(), Trace::new(robot))),
            plot: plot.map(|path| (path.into(), MotionPlot::of_pushes(pushes))),
        })
    }

    pub fn observe(&mut self, tick: &Tick) {
        self.witness.watch(&self.simulated, tick);
        if let Some(mcap) = &mut self.mcap {
            mcap.push(tick);
        }
        if let Some((_, trace)) = &mut self.trace {
            trace.push(tick);
        }
        if let Some((_, plot)) = &mut self.plot {
            plot.push(self.episode.robot, tick);
        }
    }

    /// Writes trace and plot, and returns what happened.
    pub fn finish(self, record: Record) -> Result<EpisodeReport<'a>> {
        let report = EpisodeReport {
            factory: self.episode.factory,
            config: self.episode.config,
            robot: self.episode.robot,
            pushes: self.pushes,
            variation: self.variation,
            record,
            witness: self.witness,
        };
        if let Some(mcap) = self.mcap {
            mcap.finish()?;
        }
        if let Some((path, trace)) = self.trace {
            columns::write(&path, &trace.columns())?;
        }
        if let Some((path, mut plot)) = self.plot {
            plot.end_at(report.record.end_of_interest_s());
            plot.write(&path, &report.headline())?;
        }
        Ok(report)
    }
}
