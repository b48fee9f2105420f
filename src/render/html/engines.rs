//! How far two physics engines agree, for the page.

use super::polar::Maps;
use super::telling;
use crate::campaign::verdict::agreement::{Agreement, PartedTrial, SetAgreement};
use crate::campaign::verdict::set_summary::SetSummary;
use crate::render::text::{ABOUT_AGREEMENT, about_traces, agreement_cells, where_it_parts};
use serde_json::{Value, json};

/// What the template reads beside the agreement itself. `sets` are those of the comparison: first all in one engine, then
/// all in the other.
pub(super) fn view(agreement: &Agreement, sets: &[SetSummary], maps: &Maps) -> Value {
    let of_set = |(i, set): (usize, &SetAgreement)| {
        let (a, b) = (i, agreement.sets.len() + i);
        let parted = |of: &PartedTrial| {
            let has_lost = if of.recovered_in == agreement.engines[0] { b } else { a };
            json!({
                "at": telling::point(sets, of.trial, &[has_lost]),
                "outcomes": of.outcomes.map(|outcome| outcome.name()),
                "parts": where_it_parts(agreement, of),
            })
        };
        json!({
            "cells": agreement_cells(&set.counts, &set.agreed),
            "map": maps.pair((a, b), [0, 1]),
            "parted": set.parted.iter().map(parted).collect::<Vec<_>>(),
        })
    };
    json!({
        "names": agreement.engines.map(|engine| engine.title()),
        "about": ABOUT_AGREEMENT,
        "about_traces": about_traces(agreement),
        "sets": agreement.sets.iter().enumerate().map(of_set).collect::<Vec<_>>(),
    })
}
