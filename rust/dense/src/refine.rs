//! Rounds of measuring and bending.

use crate::bend::{Datum, Stiffness, solve, value_at};
use crate::detail::{Detail, Target};
use crate::fine::{Fine, curvatures, tangents};
use crate::sheet::Sheet;
use crate::view::{Place, Seen, Sight, View};
use crate::window::{Grid, Measure, Measurement, Window};
use geometry::{Vec3, median, mesh};
use rayon::prelude::*;

/// A surface that is near the right one.
pub struct Surface<'a> {
    /// Vertices, head frame, metres.
    pub positions: &'a [Vec3],
    /// Quads that are seen from outside, counter-clockwise.
    pub quads: &'a [[u32; 4]],
    /// Of each vertex, whether it may be measured: 0 (it stays) … 1.
    pub share: &'a [f64],
}

/// How [`measure`] works.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DenseOptions {
    /// Half widths of windows, in pixels of the picture …
    pub window_px: f64,
    /// … but within these bounds, metres: smaller ones have no texture, larger ones see a bent surface.
    pub window: (f64, f64),
    /// A place is measured by at least so many views.
    pub fewest_views: usize,
    /// Displacements are expected to bend by this, a vertex against its neighbours 4 mm away, metres.
    pub bend: f64,
    /// Standard deviation of a place that nothing holds, metres.
    pub rest: f64,
    /// What a view's pose and its lens make of a place's slide, metres.
    pub slide_sigma: f64,
    /// The part of the error that is in no difference of pictures, metres.
    pub floor: f64,
    /// Measurements with larger standard deviations are none, metres.
    pub largest_sigma: f64,
}

impl Default for DenseOptions {
    fn default() -> Self {
        Self {
            window_px: 3.4,
            window: (0.0024, 0.0045),
            fewest_views: 5,
            bend: 1e-4,
            rest: 0.003,
            slide_sigma: 6e-5,
            floor: 5e-5,
            largest_sigma: 4e-4,
        }
    }
}

/// Widths of the windows of each round, in times of the usual, and how stiff the surface is then.
const ROUNDS: [(f64, f64); 4] = [(1.6, 0.5), (1.2, 0.7), (1.0, 1.0), (1.0, 1.0)];
/// Vertices with a smaller share are not measured.
const MEASURED: f64 = 0.5;
/// Vertices that are not measured are held this many times more firmly.
const HELD: f64 = 6.0;

/// Why a surface was left as it was.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Untouched {
    /// Hardly any view shows it.
    #[error("{views} frames show the face, {needed} are needed")]
    TooFewViews {
        /// How many do.
        views: usize,
        /// How many would be enough.
        needed: usize,
    },
    /// The skin shows no texture, or the views lie too close together.
    #[error("of {places} places on the skin {measured} could be measured")]
    TooFewPlaces {
        /// How many were.
        measured: usize,
        /// Of so many.
        places: usize,
    },
}

/// A measured surface.
#[derive(Clone, Debug)]
pub struct Dense {
    /// All vertices.
    pub positions: Vec<Vec3>,
    /// Of each vertex, the standard deviation of what was measured there, metres; NaN where nothing was.
    pub sigma: Vec<f64>,
    /// By how many views each vertex was measured.
    pub views: Vec<u16>,
    /// Of each vertex, how much the views differ, root mean square, parts of their grey level; NaN where nothing was measured.
    pub residual: Vec<f64>,
    /// Of each vertex, how far it went along its normal, metres.
    pub moved: Vec<f64>,
    /// What the mesh cannot hold.
    pub detail: Detail,
    /// Places that were measured …
    pub measured: usize,
    /// … of so many.
    pub places: usize,
}

/// Part of the places that has to be measured: with less it is accidents.
const ENOUGH: f64 = 0.1;

/// Measures a surface along its normals in views whose poses are known.
///
/// # Errors
/// [`Untouched`]: the surface is to stay as it is.
pub fn measure(surface: &Surface, views: &[View], options: &DenseOptions) -> Result<Dense, Untouched> {
    let triangles = mesh::triangulate(surface.quads);
    let seeing = |view| Sight::new(view, surface.positions, &triangles);
    let sights: Vec<Option<Sight>> = views.par_iter().map(seeing).collect();
    let showing = sights.iter().flatten().count();
    if showing < options.fewest_views {
        return Err(Untouched::TooFewViews { views: showing, needed: options.fewest_views });
    }
    let fine = Fine::of(surface.positions.len(), surface.quads);
    let mut state = State::new(surface, &fine, &triangles);
    let mut last = Vec::new();
    for (wide, soft) in ROUNDS {
        let places = state.places();
        last = measure_all(&places, &sights, wide, options);
        let data = state.data(&last, options);
        if (data.len() as f64) < ENOUGH * state.wanted.len() as f64 {
            return Err(Untouched::TooFewPlaces { measured: data.len(), places: state.wanted.len() });
        }
        state.bend(&data, soft * options.bend, options);
    }
    Ok(state.finish(&last, options))
}

/// What was found at a place.
struct Found {
    measurement: Measurement,
    position: Vec3,
    normal: Vec3,
}

/// What is known of the surface between two rounds.
struct State<'a> {
    surface: &'a Surface<'a>,
    fine: &'a Fine,
    triangles: &'a [[u32; 3]],
    rings: Vec<Vec<u32>>,
    /// Places that are measured.
    wanted: Vec<usize>,
    positions: Vec<Vec3>,
    /// How far the vertices have gone.
    moved: Vec<f64>,
}

impl<'a> State<'a> {
    fn new(surface: &'a Surface<'a>, fine: &'a Fine, triangles: &'a [[u32; 3]]) -> Self {
        let rings = mesh::neighbours(surface.positions.len(), &mesh::quad_edges(surface.quads));
        let is_wanted = |i: &usize| {
            let (corners, weights) = &fine.stencils[*i];
            let of = |(&c, w): (&u32, &f64)| *w == 0.0 || surface.share[c as usize] >= MEASURED;
            corners.iter().zip(weights).all(of) && !fine.rings[*i].is_empty()
        };
        let wanted = (0..fine.stencils.len()).filter(is_wanted).collect();
        let count = surface.positions.len();
        Self { surface, fine, triangles, rings, wanted, positions: surface.positions.to_vec(), moved: vec![0.0; count] }
    }

    /// Places, with how the surface bends there.
    fn places(&self) -> Vec<(Place, nalgebra::Matrix2<f64>)> {
        let normals = mesh::vertex_normals(&self.positions, self.triangles);
        let bends = curvatures(&self.positions, &normals, &self.rings);
        let (at, out, bends) =
            (self.fine.spread(&self.positions), self.fine.spread(&normals), self.fine.spread(&bends));
        let place = |&i: &usize| {
            let normal = out[i].try_normalize(1e-12).unwrap_or_else(Vec3::z);
            let tangents = tangents(&normal);
            let bend = tangents.transpose() * bends[i] * tangents;
            (Place { position: at[i], normal, tangents, stencil: self.fine.stencils[i] }, bend)
        };
        self.wanted.par_iter().map(place).collect()
    }

    fn data(&self, found: &[Option<Found>], options: &DenseOptions) -> Vec<Datum> {
        let datum = |(&i, found): (&usize, &Option<Found>)| {
            let measurement = &found.as_ref()?.measurement;
            let stencil = self.fine.stencils[i];
            let value = measurement.offset + value_at(&stencil, &self.moved);
            Some(Datum { stencil, value, sigma: sigma(measurement, options) })
        };
        self.wanted.iter().zip(found).filter_map(datum).collect()
    }

    fn bend(&mut self, data: &[Datum], bend: f64, options: &DenseOptions) {
        let held = |share: &f64| options.rest / (1.0 + (HELD - 1.0) * (1.0 - share.clamp(0.0, 1.0)));
        let stiffness = Stiffness { bend, rest: self.surface.share.iter().map(held).collect() };
        let Some((moved, _)) = solve(&self.positions, &self.rings, data, &stiffness) else { return };
        let normals = mesh::vertex_normals(&self.positions, self.triangles);
        for (((position, normal), before), after) in
            self.positions.iter_mut().zip(&normals).zip(&self.moved).zip(&moved)
        {
            *position += normal * (after - before);
        }
        self.moved = moved;
    }

    fn finish(self, found: &[Option<Found>], options: &DenseOptions) -> Dense {
        let count = self.positions.len();
        let (mut sigmas, mut views, mut residual) = (vec![f64::NAN; count], vec![0; count], vec![f64::NAN; count]);
        for (&i, found) in self.wanted.iter().zip(found).filter(|(i, _)| **i < count) {
            if let Some(Found { measurement, .. }) = found {
                sigmas[i] = sigma(measurement, options);
                views[i] = measurement.views as u16;
                residual[i] = measurement.residual;
            }
        }
        let measured = found.iter().flatten().count();
        let target = |(&place, found): (&usize, &Option<Found>)| {
            let Found { measurement, position, normal, .. } = found.as_ref()?;
            Some(Target { place, point: position + normal * measurement.offset, sigma: sigma(measurement, options) })
        };
        let targets: Vec<Target> = self.wanted.iter().zip(found).filter_map(target).collect();
        let detail = Detail::of(&self.positions, self.surface.quads, self.fine, &targets);
        Dense {
            detail,
            positions: self.positions,
            sigma: sigmas,
            views,
            residual,
            moved: self.moved,
            measured,
            places: self.wanted.len(),
        }
    }
}

/// Standard deviation of a measurement, with what poses and the way of measuring add, metres.
fn sigma(measurement: &Measurement, options: &DenseOptions) -> f64 {
    let views = measurement.views as f64;
    let of_poses = options.slide_sigma / (measurement.baseline.max(1e-3) * views.sqrt());
    (measurement.sigma.powi(2) + options.floor.powi(2) + of_poses * of_poses).sqrt()
}

fn measure_all(
    places: &[(Place, nalgebra::Matrix2<f64>)],
    sights: &[Option<Sight>],
    wide: f64,
    options: &DenseOptions,
) -> Vec<Option<Found>> {
    let grid = Grid::new();
    let nothing = Sheet { width: 2, height: 2, scale: 1.0, shift: 0.0, values: vec![0.0; 4] };
    let sheets: Vec<&Sheet> = sights.iter().map(|s| s.as_ref().map_or(&nothing, |s| &s.sheet)).collect();
    let half = wide * half_width(places, sights, options);
    let arch = pulp::Arch::new();
    let one = |(place, bend): &(Place, nalgebra::Matrix2<f64>)| {
        let seen: Vec<Seen> =
            sights.iter().enumerate().filter_map(|(k, sight)| sight.as_ref()?.see(k, place, half)).collect();
        if seen.len() < options.fewest_views {
            return None;
        }
        let window = Window { grid: &grid, half, bend: *bend, sheets: &sheets };
        let measurement = arch.dispatch(Measure { window, seen: &seen })?;
        let is_told = measurement.has_texture() && sigma(&measurement, options) < options.largest_sigma;
        is_told.then_some(Found { measurement, position: place.position, normal: place.normal })
    };
    places.par_iter().with_min_len(32).map(one).collect()
}

/// Half width of windows, metres, by how finely the views show the surface.
fn half_width(places: &[(Place, nalgebra::Matrix2<f64>)], sights: &[Option<Sight>], options: &DenseOptions) -> f64 {
    let middle = places.iter().map(|(p, _)| p.position).sum::<Vec3>() / places.len().max(1) as f64;
    let density = |sight: &Sight| {
        let depth = sight.view.cam_from_head.apply(&middle).z;
        let camera = &sight.view.camera;
        (camera.fx * camera.fy).sqrt() / depth * sight.sheet.scale.min(1.0)
    };
    let usual = median(sights.iter().flatten().map(density)).unwrap_or(1000.0);
    (options.window_px / usual).clamp(options.window.0, options.window.1)
}
