//! The grid loses no cell: what a shape reaches is found whatever its size and place, every cell once, and the counts are right.

use std::collections::BTreeSet;

use proptest::prelude::*;
use swath_core::geometry::{Frame, Point, Pose, Sight, Triangle};
use swath_core::grid::{Cell, CellSet, Grid};
use swath_tests::cases::cases;

/// What the sensor sees on the way along an arc.
#[derive(Debug, Clone)]
struct Shape {
    triangle: Triangle,
    start: Frame,
    curvature_per_m: f64,
    length_m: f64,
}

impl Shape {
    fn contains(&self, point: Point) -> bool {
        [0.0, 0.5, 1.0]
            .map(|share| self.start.advanced(self.curvature_per_m, share * self.length_m))
            .iter()
            .any(|look| self.triangle.contains(look, point))
    }

    fn for_each_touched(&self, set: &CellSet, grid: &Grid, visit: impl FnMut(Cell)) {
        let Self { triangle, start, curvature_per_m, length_m } = self;
        let end = start.advanced(*curvature_per_m, *length_m);
        let sight = Sight::along(triangle, start, &end, *curvature_per_m, *length_m);
        set.for_each_touched(grid, &sight, visit);
    }
}

/// Grids of one cell, of one row or column, around the 64 cells of a machine word, of whole metres and others.
fn grids() -> impl Strategy<Value = Grid> {
    let columns = prop_oneof![
        Just(1.0),
        Just(63.0),
        Just(64.0),
        Just(65.0),
        Just(128.0),
        Just(129.0),
        0.2..70.0
    ];
    let rows = prop_oneof![Just(1.0), (1..30_u32).prop_map(f64::from), 0.2..30.0];
    (columns, rows).prop_map(|(length_m, width_m)| Grid::new(length_m, width_m))
}

/// A heading: along an axis to the bit, almost along it, or any.
fn headings() -> impl Strategy<Value = f64> {
    let quarter = (0..4_i32).prop_map(|quarters| f64::from(quarters) * std::f64::consts::FRAC_PI_2);
    let almost = (quarter.clone(), -12.0..-5.0_f64).prop_map(|(q, e)| q + 10.0_f64.powf(e));
    prop_oneof![quarter, almost, -7.0..7.0]
}

/// A shape and a point in it, somewhere on, across or beside a pasture of `length_m` by `width_m`.
fn shapes(length_m: f64, width_m: f64) -> impl Strategy<Value = (Shape, Point)> {
    let pose = (-15.0..length_m + 15.0, -15.0..width_m + 15.0, headings())
        .prop_map(|(x_m, y_m, heading_rad)| Pose::new(x_m, y_m, heading_rad));
    let look = (0.0..=1.0, -1.0..=1.0, 0.0..=1.0);
    (pose, 0.3..40.0, 0.1..40.0, -2.0..2.0_f64, 0.0..0.6, look).prop_map(
        |(pose, range_m, wide_m, curvature_per_m, length_m, (along, across, share))| {
            let start = Frame::from(pose);
            let look = start.advanced(curvature_per_m, share * length_m);
            let in_it = Point::new(along * range_m, 0.5 * along * across * wide_m);
            let point = look.pose.world_from_mower() * in_it;
            let triangle = Triangle::new(range_m, wide_m);
            (Shape { triangle, start, curvature_per_m, length_m }, point)
        },
    )
}

fn grids_and_shapes() -> impl Strategy<Value = (Grid, Shape, Point)> {
    grids().prop_flat_map(|grid| {
        let (length_m, width_m) = grid.size_m();
        (Just(grid), shapes(length_m, width_m))
            .prop_map(|(grid, (shape, point))| (grid, shape, point))
    })
}

fn all_cells(grid: &Grid) -> Vec<(usize, usize)> {
    (0..grid.rows()).flat_map(|row| (0..grid.columns()).map(move |column| (column, row))).collect()
}

/// The cells of `set` that a shape may touch.
fn touched(grid: &Grid, set: &CellSet, shape: &Shape) -> Vec<(usize, usize)> {
    let mut visited = Vec::new();
    shape.for_each_touched(set, grid, |cell| visited.push((cell.column, cell.row)));
    visited
}

/// The cells of every `thinned_by`-th kind.
fn some_cells(grid: &Grid, thinned_by: usize) -> Vec<(usize, usize)> {
    all_cells(grid).into_iter().filter(|&(c, r)| (c + 3 * r).is_multiple_of(thinned_by)).collect()
}

fn set_of(grid: &Grid, cells: &[(usize, usize)]) -> CellSet {
    let mut set = CellSet::empty(grid);
    for &(column, row) in cells {
        assert!(set.insert(grid.cell_at(grid.centre(column, row))));
        assert!(!set.insert(grid.cell_at(grid.centre(column, row))));
    }
    set
}

proptest! {
    #![proptest_config(cases())]

    #[test]
    fn no_cell_of_the_set_is_lost_whose_centre_lies_in_a_shape(
        (grid, shape, _) in grids_and_shapes(), thinned_by in 1..30_usize,
    ) {
        let members = some_cells(&grid, thinned_by);
        let visited: BTreeSet<_> =
            touched(&grid, &set_of(&grid, &members), &shape).into_iter().collect();
        for (column, row) in members {
            let is_inside = shape.contains(grid.centre(column, row));
            prop_assert!(!is_inside || visited.contains(&(column, row)), "{column}, {row}");
        }
    }

    #[test]
    fn no_cell_is_lost_of_which_any_point_lies_in_a_shape(
        (grid, shape, point) in grids_and_shapes(), is_alone in any::<bool>(),
    ) {
        let (length_m, width_m) = grid.size_m();
        if (0.0..=length_m).contains(&point.x) && (0.0..=width_m).contains(&point.y) {
            let cell = grid.cell_of(point);
            let set = if is_alone { set_of(&grid, &[cell]) } else { CellSet::full(&grid) };
            let visited = touched(&grid, &set, &shape);
            prop_assert!(visited.contains(&cell), "{cell:?} holds {point}");
        }
    }

    #[test]
    fn every_cell_of_the_set_is_visited_at_most_once_and_no_other(
        (grid, shape, _) in grids_and_shapes(), thinned_by in 1..7_usize,
    ) {
        let members: BTreeSet<_> = some_cells(&grid, thinned_by).into_iter().collect();
        let visited = touched(&grid, &set_of(&grid, &some_cells(&grid, thinned_by)), &shape);
        let found: BTreeSet<_> = visited.iter().copied().collect();
        prop_assert_eq!(found.len(), visited.len());
        prop_assert!(found.is_subset(&members));
    }

    #[test]
    fn the_cells_of_a_rectangle_are_those_of_its_columns_and_rows(
        grid in grids(), thinned_by in 1..7_usize, corners in prop::array::uniform4(0..1000_usize),
    ) {
        let range = |a: usize, b: usize, cells: usize| {
            let at = |thousandths: usize| thousandths * cells / 1000;
            at(a.min(b))..at(a.max(b)) + 1
        };
        let [a, b, c, d] = corners;
        let (columns, rows) = (range(a, b, grid.columns()), range(c, d, grid.rows()));
        let members = some_cells(&grid, thinned_by);
        let mut visited = BTreeSet::new();
        set_of(&grid, &members).for_each_in(&grid, columns.clone(), rows.clone(), |cell| {
            assert!(visited.insert((cell.column, cell.row)), "{cell:?} twice");
        });
        let is_in = |&(c, r): &(usize, usize)| columns.contains(&c) && rows.contains(&r);
        prop_assert_eq!(visited, members.into_iter().filter(is_in).collect());
    }

    /// Removing what lies in a shape leaves the rest, and as many as were counted.
    #[test]
    fn removed_cells_are_gone_the_others_stay_and_the_count_is_right(
        (grid, shape, _) in grids_and_shapes(), thinned_by in 1..5_usize,
    ) {
        let members = some_cells(&grid, thinned_by);
        let mut set = set_of(&grid, &members);
        prop_assert_eq!(set.len(), members.len());
        let (inside, outside): (Vec<(usize, usize)>, Vec<_>) =
            members.iter().partition(|&&(c, r)| shape.contains(grid.centre(c, r)));
        for (column, row) in inside {
            let cell = grid.cell_at(grid.centre(column, row));
            prop_assert!(set.remove(cell));
            prop_assert!(!set.remove(cell));
        }
        prop_assert_eq!(set.len(), outside.len());
        prop_assert_eq!(set.is_empty(), outside.is_empty());
        let left: Vec<_> =
            all_cells(&grid).into_iter().filter(|&(c, r)| set.contains(&grid, c, r)).collect();
        prop_assert_eq!(left, outside);
    }

    #[test]
    fn a_set_comes_back_from_its_words(grid in grids(), thinned_by in 1..7_usize) {
        let set = set_of(&grid, &some_cells(&grid, thinned_by));
        let words = set.words().to_vec();
        let back = CellSet::from_words(&grid, words.clone());
        prop_assert_eq!(back.as_ref(), Some(&set));
        let bits: u32 = words.iter().map(|word| word.count_ones()).sum();
        prop_assert_eq!(bits as usize, set.len());
        let longer = [words.clone(), vec![0]].concat();
        prop_assert_eq!(CellSet::from_words(&grid, longer), None);
        prop_assert_eq!(CellSet::from_words(&grid, words[1..].to_vec()), None);
    }
}

#[test]
fn a_bit_outside_the_grid_makes_no_set() {
    for columns in [1.0, 63.0, 65.0, 129.0] {
        let grid = Grid::new(columns, 3.0);
        let mut words = CellSet::full(&grid).words().to_vec();
        let last = words.len() - 1;
        assert!(CellSet::from_words(&grid, words.clone()).is_some());
        words[last] = u64::MAX;
        assert_eq!(CellSet::from_words(&grid, words), None, "{columns} columns");
    }
    assert!(CellSet::from_words(&Grid::new(8.0, 8.0), vec![u64::MAX]).is_some());
}

#[test]
fn a_pasture_of_whole_metres_is_cut_into_square_metres_and_others_evenly() {
    for (length_m, width_m, columns, rows) in [
        (1.0, 1.0, 1, 1),
        (100.0, 40.0, 100, 40),
        (36.0, 26.0, 36, 26),
        (63.0, 64.0, 63, 64),
        (129.0, 65.0, 129, 65),
        (0.3, 0.3, 1, 1),
        (10.5, 7.01, 11, 8),
        // 26 m as twenty decks of 1.3 m, which rounding makes a little more.
        (20.0 * 1.3, 3.0 * 1.1, 26, 4),
    ] {
        let grid = Grid::new(length_m, width_m);
        assert_eq!((grid.columns(), grid.rows()), (columns, rows), "{length_m} x {width_m} m");
        assert_eq!(grid.cells(), columns * rows);
        let (x_m, y_m) = grid.size_m();
        assert!((x_m - length_m).abs() < 1e-9 && (y_m - width_m).abs() < 1e-9);
        assert_eq!(CellSet::full(&grid).len(), columns * rows);
        assert_eq!(CellSet::empty(&grid).len(), 0);
        for (column, row) in all_cells(&grid) {
            let centre = grid.centre(column, row);
            let expected = Point::new(
                (column as f64 + 0.5) * length_m / columns as f64,
                (row as f64 + 0.5) * width_m / rows as f64,
            );
            assert!((centre - expected).norm() < 1e-9);
            assert_eq!(grid.cell_of(centre), (column, row));
        }
    }
}

#[test]
fn points_beside_the_pasture_belong_to_its_nearest_cell() {
    let grid = Grid::new(10.0, 5.0);
    for (point, cell) in [
        ((-3.0, 2.5), (0, 2)),
        ((10.0, 5.0), (9, 4)),
        ((99.0, -1.0), (9, 0)),
        ((4.5, 1e9), (4, 4)),
        ((0.0, 0.0), (0, 0)),
    ] {
        assert_eq!(grid.cell_of(Point::new(point.0, point.1)), cell, "{point:?}");
    }
}
