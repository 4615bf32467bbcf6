//! Alpha that a rising threshold fades out: leaf by leaf, or from the outside of the texture to its centre.

use image::RgbaImage;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::distance::{NearestSites, nearest_sites};
use crate::math::color::unorm8;

/// Distance outside the outline, in texels, at which alpha has fallen to 0.
const FALLOFF: f32 = 2.0;
/// Smallest difference from 0.5 on either side of an outline: 1.5 steps of 8 bits, so that rounding keeps sides apart.
const STEP: f32 = 1.5 / 255.0;
/// A hole whose area is below this share of all leaves' area is a gap between leaves or a flaw, not an outline.
const PINHOLE: f64 = 1e-3;

/// The order in which texels disappear as the threshold of the alpha test rises. In either order each threshold hides
/// the same area.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum AlphaFade {
    /// Every leaf shrinks from its outline to its middle, all at the same time. Not in the publication. Its mips are
    /// more accurate: alpha with the same distribution in all leaves preserves the shape of the crown when it is
    /// averaged.
    #[default]
    PerLeaf,
    /// As published [Franzke 2005, 4.3.3, fig. 4.15]: alpha falls with the distance from the centre of the texture, so
    /// a crown grows from the inside outwards, and its outermost leaves are the last to appear. Pops less: the largest
    /// step of a change of level is 14 to 27 % smaller. Costs 3 to 8 % of error in the mips of whole crosses, at all
    /// distances beyond the change (`docs/measurements/alpha-fade.md`).
    CenterOut,
}

/// Restructures alpha so that raising the alpha threshold from 0.5 to 1 fades the texture out evenly, in the order that
/// `fade` says. Colours stay as they are (see [`super::dilate_colors`]).
///
/// `cutoff` (0..1) is the threshold with which the image was made to be drawn: a *leaf* is a connected region (four
/// neighbours) of texels with `alpha >= cutoff`, its outline the line on which interpolated alpha crosses `cutoff`.
/// In the result
///
/// - inside, `alpha = 0.5 + 0.5 a`. By [`AlphaFade::PerLeaf`] `a` is the fraction of *that leaf's* area which lies
///   nearer to its outline, by [`AlphaFade::CenterOut`] the fraction of all leaves' area which lies farther from the
///   texture's centre. So alpha is spread evenly over the area: a threshold `t` of 0.5..1 hides `2 (t - 0.5)` of it,
///   the outer share of every leaf, whatever its size and shape, or of the texture. Exact up to the 8 bits and to
///   texels of equal distance, which share their middle rank (a leaf of a single texel has 0.75 by the former).
///   Interpolated between texels the latter hides a little more: near the centre alpha is high up to a leaf's outline,
///   which recedes by a fraction of a texel;
/// - across the outline interpolated alpha passes 0.5 where it passed `cutoff` before (to a fraction of a texel);
/// - outside, alpha falls to 0 within 2 texels, which antialiases the outline;
/// - holes of less than a thousandth of the leaves' area stay holes, but leaves do not shrink away from them: the
///   pinholes of a photographed twig would grow into bites.
///
/// Distances are exact Euclidean ones in texels, those to an outline with its subtexel position taken from the given
/// alpha. A `cutoff` of 0 or less makes the whole image one leaf without an outline: every alpha is 1. Where nothing
/// reaches `cutoff`, every alpha is 0.
pub fn fade_alpha(image: &RgbaImage, cutoff: f32, fade: AlphaFade) -> RgbaImage {
    let mut out = image.clone();
    let width = image.width() as usize;
    let cutoff = if cutoff.is_finite() { cutoff.clamp(0.0, 1.0) } else { 0.5 };
    let alphas: Vec<f32> = image.as_raw().chunks_exact(4).map(|texel| f32::from(texel[3]) / 255.0).collect();
    let inside: Vec<bool> = alphas.iter().map(|&alpha| alpha >= cutoff).collect();
    let uniform = if !inside.contains(&true) {
        Some(0)
    } else if !inside.contains(&false) {
        Some(255)
    } else {
        None
    };
    if let Some(alpha) = uniform {
        out.chunks_exact_mut(4).for_each(|texel| texel[3] = alpha);
        return out;
    }

    let outline = Outline { width, alphas: &alphas, inside: &inside, cutoff };
    let area = match fade {
        AlphaFade::PerLeaf => leaf_ranks(&outline),
        AlphaFade::CenterOut => center_ranks(&inside, width),
    };
    let faded: Vec<u8> = (0..area.len())
        .into_par_iter()
        .map(|at| {
            let alpha = if inside[at] { 0.5 + (0.5 * area[at]).max(STEP) } else { outline.outside_alpha(at, &area) };
            unorm8(alpha)
        })
        .collect();
    for (texel, alpha) in out.chunks_exact_mut(4).zip(faded) {
        texel[3] = alpha;
    }
    out
}

/// For every inside texel the fraction, 0..1, of its leaf's area that lies nearer to the outline; 0 outside.
fn leaf_ranks(outline: &Outline) -> Vec<f32> {
    let &Outline { width, inside, .. } = outline;
    let closed = close_pinholes(inside, width);
    let shape = Outline { inside: &closed, ..*outline };
    let outside: Vec<bool> = closed.iter().map(|inside| !inside).collect();
    let sites = nearest_sites(&outside, width);
    let depth: Vec<f32> =
        (0..inside.len()).into_par_iter().map(|at| if inside[at] { shape.depth(at, &sites) } else { 0.0 }).collect();
    area_fractions(inside, &label_regions(&closed, width), &depth)
}

/// For every inside texel the fraction, 0..1, of all inside texels that lie farther from the texture's centre; 0
/// outside.
fn center_ranks(inside: &[bool], width: usize) -> Vec<f32> {
    let height = inside.len() / width.max(1);
    let half = |size: usize| 0.5 * size as f32;
    let farthest = half(width).hypot(half(height));
    let nearness = (0..inside.len()).map(|at| {
        let (x, y) = ((at % width) as f32 + 0.5 - half(width), (at / width) as f32 + 0.5 - half(height));
        (farthest - x.hypot(y)).max(0.0)
    });
    area_fractions(inside, &vec![1; inside.len()], &nearness.collect::<Vec<f32>>())
}

/// `inside` with its small holes filled; as it is where nothing would remain outside.
fn close_pinholes(inside: &[bool], width: usize) -> Vec<bool> {
    let outside: Vec<bool> = inside.iter().map(|inside| !inside).collect();
    let labels = label_regions(&outside, width);
    let mut areas = vec![0usize; labels.iter().max().map_or(0, |&most| most as usize) + 1];
    for &label in &labels {
        areas[label as usize] += 1;
    }
    // Label 0 is the inside.
    let limit = (areas[0] as f64 * PINHOLE) as usize;
    let closed: Vec<bool> = labels.iter().map(|&label| label == 0 || areas[label as usize] <= limit).collect();
    if closed.contains(&false) { closed } else { inside.to_vec() }
}

/// The line on which interpolated alpha crosses the cutoff.
#[derive(Clone, Copy)]
struct Outline<'a> {
    width: usize,
    alphas: &'a [f32],
    inside: &'a [bool],
    cutoff: f32,
}

impl Outline<'_> {
    /// The neighbours of texel `at` that lie on the other side of the outline, apart for the two axes.
    fn across(&self, at: usize) -> [[Option<usize>; 2]; 2] {
        let x = at % self.width;
        let other = |neighbour: Option<usize>| {
            neighbour.filter(|&n| n < self.inside.len() && self.inside[n] != self.inside[at])
        };
        [
            [
                other(if x > 0 { Some(at - 1) } else { None }),
                other(if x + 1 < self.width { Some(at + 1) } else { None }),
            ],
            [other(at.checked_sub(self.width)), other(Some(at + self.width))],
        ]
    }

    /// Distance from texel `at` to the crossing on the way to its neighbour `to`, 0..1 texels.
    fn crossing(&self, at: usize, to: usize) -> f32 {
        let difference = self.alphas[to] - self.alphas[at];
        if difference == 0.0 { 0.5 } else { ((self.cutoff - self.alphas[at]) / difference).clamp(0.0, 1.0) }
    }

    /// Distance from a texel beside the outline to the line through its nearest crossings along x and y, in texels.
    fn edge_distance(&self, at: usize) -> Option<f32> {
        let nearest = self
            .across(at)
            .map(|axis| axis.into_iter().flatten().map(|to| self.crossing(at, to)).fold(f32::INFINITY, f32::min));
        match nearest {
            [x, y] if x.is_finite() && y.is_finite() => {
                Some(if x + y > 0.0 { x * y / (x * x + y * y).sqrt() } else { 0.0 })
            }
            [x, y] => Some(x.min(y)).filter(|distance| distance.is_finite()),
        }
    }

    /// Distance from the inside texel `at` to the outline in texels; `outside` are the texels of the other side.
    fn depth(&self, at: usize, outside: &NearestSites) -> f32 {
        self.edge_distance(at).unwrap_or_else(|| {
            let whole = outside.distance(at % self.width, at / self.width);
            let site = outside.nearest.get(at).copied().flatten();
            let beyond = site.and_then(|[x, y]| self.edge_distance(y as usize * self.width + x as usize));
            (whole - beyond.unwrap_or(0.5)).max(0.0)
        })
    }

    /// Distance in texels from the outside texel `at` to the outline, if that is within [`FALLOFF`].
    fn outside_distance(&self, at: usize) -> Option<f32> {
        let reach = FALLOFF.ceil() as usize;
        let (x, y) = (at % self.width, at / self.width);
        let columns = x.saturating_sub(reach)..(x + reach + 1).min(self.width);
        let rows = y.saturating_sub(reach)..(y + reach + 1).min(self.inside.len() / self.width);
        rows.flat_map(|row| columns.clone().map(move |column| (column, row)))
            .filter(|&(column, row)| self.inside[row * self.width + column])
            .map(|(column, row)| {
                let (dx, dy) = (column.abs_diff(x) as f32, row.abs_diff(y) as f32);
                (dx * dx + dy * dy).sqrt() - self.edge_distance(row * self.width + column).unwrap_or(0.5)
            })
            .min_by(f32::total_cmp)
            .filter(|&distance| distance < FALLOFF)
    }

    /// Alpha of an outside texel. Beside the outline it is chosen so that interpolation towards the inside crosses
    /// 0.5 on the outline; farther out it falls off.
    fn outside_alpha(&self, at: usize, area: &[f32]) -> f32 {
        let (mut sum, mut count) = (0.0f32, 0.0f32);
        for to in self.across(at).into_iter().flatten().flatten() {
            let crossing = self.crossing(at, to);
            sum += (0.5 * area[to]).max(STEP) * crossing / (1.0 - crossing).max(0.05);
            count += 1.0;
        }
        if count > 0.0 {
            return (0.5 - (sum / count).max(STEP)).max(0.0);
        }
        self.outside_distance(at).map_or(0.0, |distance| 0.5 * (1.0 - distance / FALLOFF).clamp(0.0, 0.75))
    }
}

/// For every inside texel the fraction, 0..1, of its region's texels that have less depth (those of equal depth count
/// half); 0 outside. `regions` numbers the regions.
fn area_fractions(inside: &[bool], regions: &[u32], depth: &[f32]) -> Vec<f32> {
    // Depths are not negative, so their bits sort as they do; the region goes first.
    let mut order: Vec<(u64, u32)> = (0..inside.len())
        .filter(|&at| inside[at])
        .map(|at| (u64::from(regions[at]) << 32 | u64::from(depth[at].to_bits()), at as u32))
        .collect();
    order.par_sort_unstable();
    let mut fractions = vec![0.0; inside.len()];
    for region in order.chunk_by(|a, b| a.0 >> 32 == b.0 >> 32) {
        let mut below = 0usize;
        for equal in region.chunk_by(|a, b| a.0 == b.0) {
            let fraction = (below as f64 + 0.5 * equal.len() as f64) / region.len() as f64;
            for &(_, at) in equal {
                fractions[at as usize] = fraction as f32;
            }
            below += equal.len();
        }
    }
    fractions
}

/// Numbers the regions of inside texels that touch along an edge, from 1; 0 is outside.
fn label_regions(inside: &[bool], width: usize) -> Vec<u32> {
    let mut labels = vec![0u32; inside.len()];
    let mut stack = Vec::new();
    let mut label = 0;
    for start in 0..inside.len() {
        if !inside[start] || labels[start] != 0 {
            continue;
        }
        label += 1;
        labels[start] = label;
        stack.push(start);
        while let Some(at) = stack.pop() {
            let x = at % width;
            let left = if x > 0 { Some(at - 1) } else { None };
            let right = if x + 1 < width { Some(at + 1) } else { None };
            let below = Some(at + width).filter(|&below| below < inside.len());
            for to in [left, right, at.checked_sub(width), below].into_iter().flatten() {
                if inside[to] && labels[to] == 0 {
                    labels[to] = label;
                    stack.push(to);
                }
            }
        }
    }
    labels
}
