//! The printed table: one row a step, ours, OpenSubdiv's, and how many times better ours is.

use drumlin_benches::{
    measure::{Table, Timing, three_digits},
    peer::PeerFigures,
};

use crate::{Case, ours::Ours};

/// A name, our figure and theirs.
struct Row {
    name: &'static str,
    ours: f64,
    theirs: Option<f64>,
    /// True where less is better.
    less: bool,
}

/// The table of a cage with so many faces.
pub(crate) fn table(case: &Case, faces: f64) -> Table {
    let peer = case.open_subdiv.as_ref().map(Medians::of);
    let mut table = Table::new(&["step", "ours", "OpenSubdiv", "times better"]);
    let rows = set_up_rows(&case.ours, peer.as_ref());
    let rows = rows
        .into_iter()
        .chain(rate_rows(&case.ours, peer.as_ref(), faces));
    for row in rows.chain(byte_rows(&case.ours, peer.as_ref(), faces)) {
        let better = |theirs: f64| {
            if row.less {
                theirs / row.ours
            } else {
                row.ours / theirs
            }
        };
        let text = |value: Option<f64>| value.map(three_digits).unwrap_or_default();
        table.row([
            row.name.to_owned(),
            three_digits(row.ours),
            text(row.theirs),
            text(row.theirs.map(better)),
        ]);
    }
    table
}

/// OpenSubdiv's medians.
struct Medians<'a> {
    figures: &'a PeerFigures,
    topology: f64,
    patches: f64,
    stencils: f64,
    update: f64,
    positions: f64,
    derivatives: f64,
}

impl<'a> Medians<'a> {
    fn of(figures: &'a PeerFigures) -> Self {
        let median = |seconds: &[f64]| Timing::of(seconds.to_vec()).median;
        let update = [&figures.update_primvar, &figures.update_stencils];
        Self {
            topology: median(&figures.refiner) + median(&figures.adaptive),
            patches: median(&figures.patch_table),
            stencils: median(&figures.stencil_table),
            update: update
                .map(|way| median(way))
                .into_iter()
                .fold(f64::INFINITY, f64::min),
            positions: median(&figures.positions),
            derivatives: median(&figures.derivatives),
            figures,
        }
    }
}

fn set_up_rows(ours: &Ours, peer: Option<&Medians<'_>>) -> [Row; 4] {
    let first = ours.link.median + ours.tables.median + ours.update.median;
    let row = |name, ours, theirs: fn(&Medians<'_>) -> f64| Row {
        name,
        ours,
        theirs: peer.map(theirs),
        less: true,
    };
    [
        row("to first points, s", first, |peer| {
            peer.topology + peer.update
        }),
        row("to first points with patches, s", first, |peer| {
            peer.topology + peer.update + peer.patches
        }),
        row(
            "to first points with patches and stencils, s",
            first,
            |peer| peer.topology + peer.update + peer.patches + peer.stencils,
        ),
        row("update, the best way, s", ours.update.median, |peer| {
            peer.update
        }),
    ]
}

fn rate_rows(ours: &Ours, peer: Option<&Medians<'_>>, faces: f64) -> [Row; 3] {
    let row = |name, ours, theirs| Row {
        name,
        ours,
        theirs,
        less: false,
    };
    let set_up = ours.link.median + ours.tables.median;
    let rate = |timing: &Timing| 1e-6 * timing.rate(ours.places);
    let their_rate = |seconds: fn(&Medians<'_>) -> f64| {
        peer.map(|peer| 1e-6 * peer.figures.places as f64 / seconds(peer))
    };
    [
        row(
            "set-up with patches, Mfaces/s",
            1e-6 * faces / set_up,
            peer.map(|peer| 1e-6 * faces / (peer.topology + peer.patches)),
        ),
        row(
            "limit positions, Mpoints/s",
            rate(&ours.positions),
            their_rate(|peer| peer.positions),
        ),
        row(
            "limit positions and derivatives, Mpoints/s",
            rate(&ours.derivatives),
            their_rate(|peer| peer.derivatives),
        ),
    ]
}

fn byte_rows(ours: &Ours, peer: Option<&Medians<'_>>, faces: f64) -> [Row; 2] {
    let row = |name, ours: u64, theirs: fn(&PeerFigures) -> u64| Row {
        name,
        ours: ours as f64 / faces,
        theirs: peer.map(|peer| theirs(peer.figures) as f64 / faces),
        less: true,
    };
    [
        row("tables, bytes a face", ours.table_bytes, |peer| {
            peer.patch_table_bytes + peer.stencil_table_bytes
        }),
        row(
            "tables and topology, bytes a face",
            ours.table_bytes + ours.link_bytes,
            |peer| peer.patch_table_bytes + peer.stencil_table_bytes + peer.refiner_bytes,
        ),
    ]
}
