//! The lower half of a symmetric sparse matrix, filled by cells whose places in it are found once.

use std::ops::Range;

use rayon::prelude::*;

/// Values that a thread clears at once.
const CLEARED: usize = 1 << 15;
/// Diagonal entries that it adds to at least.
const ADDED: usize = 4096;

/// No equation: the component is held or has no stiffness.
pub const NONE: u32 = u32::MAX;

/// Lower triangle with diagonal, column by column, rows increasing.
#[derive(Clone, Debug, Default)]
pub struct LowerMatrix {
    /// Starts of the entries of each column, and the end of the last.
    pub column_start: Vec<u32>,
    /// The row of each entry.
    pub row: Vec<u32>,
    /// The entries.
    pub value: Vec<f64>,
    /// The entries mirrored at the diagonal, for matrices that are not symmetric; else empty.
    pub mirror: Vec<f64>,
}

/// The equations of a model: components of nodes that are free, numbered node by node.
#[derive(Clone, Debug)]
pub struct Equations {
    /// The equation of each component, six a node.
    pub number: Vec<u32>,
    /// The component of each equation.
    pub component: Vec<u32>,
}

impl Equations {
    /// Numbers the components that are free.
    pub fn new(free: &[bool]) -> Self {
        let component: Vec<u32> = (0..free.len() as u32).filter(|&i| free[i as usize]).collect();
        let mut number = vec![NONE; free.len()];
        for (equation, &component) in component.iter().enumerate() {
            number[component as usize] = equation as u32;
        }
        Self { number, component }
    }

    /// Number of equations.
    pub fn count(&self) -> usize {
        self.component.len()
    }

    /// Number of equations of the nodes before a node.
    pub fn before(&self, node: u32) -> usize {
        self.component.partition_point(|&component| component < 6 * node)
    }

    /// Equations of the first components of a node.
    fn of<const C: usize>(&self, node: u32) -> &[u32; C] {
        self.number[6 * node as usize..].first_chunk().expect("a node has six components")
    }

    /// The first equation of a node, if any.
    fn first(&self, node: u32) -> u32 {
        let numbers = &self.number[6 * node as usize..6 * node as usize + 6];
        numbers.iter().copied().min().unwrap_or(NONE)
    }
}

/// A cell's matrix on its way into a larger one.
pub struct Cell<'a> {
    /// Its nodes.
    pub nodes: &'a [u32],
    /// Components of each node.
    pub components: usize,
    /// Its [places](LowerMatrix::places).
    pub places: &'a [u32],
    /// Column by column.
    pub entries: &'a [f64],
}

/// The values of consecutive columns.
pub struct Values<'a> {
    /// The place of the first.
    first: usize,
    value: &'a mut [f64],
    mirror: &'a mut [f64],
}

impl Values<'_> {
    /// Splits into the values before a place, and the values from there on.
    pub fn split_at(self, place: usize) -> (Self, Self) {
        let Self { first, value, mirror } = self;
        let (value, after) = value.split_at_mut(place - first);
        let (mirror, mirror_after) = mirror.split_at_mut(value.len().min(mirror.len()));
        (Self { first, value, mirror }, Self { first: place, value: after, mirror: mirror_after })
    }

    /// Adds a value to the diagonal entries of some columns, which are these.
    fn add_diagonals(
        self,
        column_start: &[u32],
        columns: Range<usize>,
        value: &(impl Fn(usize) -> f64 + Sync),
    ) {
        if columns.len() <= ADDED {
            for column in columns {
                let (at, added) = (column_start[column] as usize - self.first, value(column));
                self.value[at] += added;
                if let Some(mirror) = self.mirror.get_mut(at) {
                    *mirror += added;
                }
            }
            return;
        }
        let middle = columns.start.midpoint(columns.end);
        let (before, after) = self.split_at(column_start[middle] as usize);
        rayon::join(
            || before.add_diagonals(column_start, columns.start..middle, value),
            || after.add_diagonals(column_start, middle..columns.end, value),
        );
    }

    /// Adds the columns of one of a cell's nodes.
    pub fn add(&mut self, equations: &Equations, cell: &Cell<'_>, node: usize) {
        match cell.components {
            6 => self.add_columns::<6>(equations, cell, node),
            _ => self.add_columns::<3>(equations, cell, node),
        }
    }

    fn add_columns<const C: usize>(&mut self, equations: &Equations, cell: &Cell<'_>, node: usize) {
        let &Cell { nodes, places, entries, .. } = cell;
        let size = nodes.len() * C;
        let columns = equations.of::<C>(nodes[node]);
        for (a, &row_node) in nodes.iter().enumerate().filter(|(_, row)| **row >= nodes[node]) {
            let first = equations.first(row_node);
            let rows = equations.of::<C>(row_node);
            let all_free = self.mirror.is_empty() && !rows.contains(&NONE);
            for (c, &column) in columns.iter().enumerate().filter(|(_, column)| **column != NONE) {
                let base = places[(a * nodes.len() + node) * C + c];
                let place = |row: u32| base.wrapping_add(row - first) as usize - self.first;
                let j = node * C + c;
                if all_free {
                    // Nearly all nodes: their rows follow one another, the rows of the column's own node from
                    // the diagonal on.
                    let part: &[f64; C] =
                        entries[j * size + a * C..].first_chunk().expect("a cell has all rows");
                    let add = |(value, added): (&mut f64, &f64)| *value += added;
                    if row_node == nodes[node] {
                        let values = &mut self.value[place(column)..][..C - c];
                        values.iter_mut().zip(&part[c..]).for_each(add);
                    } else {
                        let values = &mut self.value[place(rows[0])..][..C];
                        values.iter_mut().zip(part).for_each(add);
                    }
                    continue;
                }
                for (r, &row) in rows.iter().enumerate().filter(|(_, row)| **row != NONE && **row >= column) {
                    let (at, i) = (place(row), a * C + r);
                    self.value[at] += entries[j * size + i];
                    if let Some(mirror) = self.mirror.get_mut(at) {
                        *mirror += entries[i * size + j];
                    }
                }
            }
        }
    }
}

impl LowerMatrix {
    /// The pattern of cells that couple all equations of their nodes, and of pairs of nodes, the lower first,
    /// whose translations are coupled.
    pub fn new<'a>(
        equations: &Equations,
        cells: impl Iterator<Item = &'a [u32]>,
        pairs: &[[u32; 2]],
    ) -> Self {
        let nodes = equations.number.len() / 6;
        // Of each node, itself and the neighbours with higher numbers.
        let mut above: Vec<Vec<u32>> = (0..nodes as u32).map(|node| vec![node]).collect();
        for cell in cells {
            for &a in cell {
                above[a as usize].extend(cell.iter().filter(|&&b| b > a));
            }
        }
        let mut matrix =
            Self { column_start: vec![0], row: Vec::new(), value: Vec::new(), mirror: Vec::new() };
        // Neighbours by translations only.
        let mut aside: Vec<Vec<u32>> = vec![Vec::new(); nodes];
        for &[low, high] in pairs {
            aside[low as usize].push(high);
        }
        for (node, (above, aside)) in above.iter_mut().zip(&mut aside).enumerate() {
            above.sort_unstable();
            above.dedup();
            aside.retain(|other| above.binary_search(other).is_err());
            let mut others: Vec<(u32, usize)> = above.iter().map(|&other| (other, 6)).collect();
            others.extend(aside.iter().map(|&other| (other, 3)));
            others.sort_unstable();
            others.dedup();
            let numbers = equations.number[6 * node..6 * node + 6].iter().enumerate();
            for (component, &column) in numbers.filter(|(_, e)| **e != NONE) {
                for &(other, count) in others.iter().filter(|(_, count)| component < *count) {
                    let rows = &equations.number[6 * other as usize..6 * other as usize + count];
                    matrix.row.extend(rows.iter().filter(|&&row| row != NONE && row >= column));
                }
                matrix.column_start.push(matrix.row.len() as u32);
            }
        }
        matrix.value = vec![0.0; matrix.row.len()];
        matrix
    }

    /// The number of columns.
    #[inline]
    pub fn columns(&self) -> usize {
        self.column_start.len() - 1
    }

    /// The rows of a column.
    #[inline]
    pub fn rows(&self, column: u32) -> &[u32] {
        &self.row
            [self.column_start[column as usize] as usize..self.column_start[column as usize + 1] as usize]
    }

    /// Keeps both halves from now on.
    pub fn keep_mirror(&mut self) {
        self.mirror = vec![0.0; self.value.len()];
    }

    /// Sets all entries to zero.
    pub fn clear(&mut self) {
        self.value.par_chunks_mut(CLEARED).for_each(|values| values.fill(0.0));
        self.mirror.fill(0.0);
    }

    /// Values of the matrix, and the start of each column.
    pub fn values(&mut self) -> (Values<'_>, &[u32]) {
        let Self { column_start, value, mirror, .. } = self;
        (Values { first: 0, value, mirror }, column_start)
    }

    /// Place in the values where the rows of node `row` start in an equation's column, as if the row node's
    /// first equation had a place there. Wraps below zero.
    fn base(&self, equations: &Equations, row_node: u32, column: u32) -> u32 {
        let start = self.column_start[column as usize];
        let rows = &self.row[start as usize..self.column_start[column as usize + 1] as usize];
        let first = equations.first(row_node);
        match rows.binary_search(&first) {
            Ok(at) => start + at as u32,
            // The node of the column itself: its rows start at the diagonal.
            Err(_) => start.wrapping_sub(column.wrapping_sub(first)),
        }
    }

    /// The places of a cell: for each ordered pair of its nodes (row, column) and each component of the
    /// column.
    pub fn places(&self, equations: &Equations, nodes: &[u32], components: usize) -> Vec<u32> {
        let mut places = Vec::with_capacity(nodes.len() * nodes.len() * components);
        for &row_node in nodes {
            for &column_node in nodes {
                for c in 0..components {
                    let column = equations.number[6 * column_node as usize + c];
                    let below =
                        row_node >= column_node && column != NONE && equations.first(row_node) != NONE;
                    places.push(if below { self.base(equations, row_node, column) } else { NONE });
                }
            }
        }
        places
    }

    /// Adds a cell's matrix; of a symmetric one the lower half.
    pub fn add(&mut self, equations: &Equations, cell: &Cell<'_>) {
        let (mut values, _) = self.values();
        (0..cell.nodes.len()).for_each(|node| values.add(equations, cell, node));
    }

    /// True if the pattern couples the translations of two nodes, the lower number first, or if one of them
    /// has no free translation.
    pub fn couples(&self, equations: &Equations, [low, high]: [u32; 2]) -> bool {
        let [column, row] = [low, high].map(|node| {
            let translations = &equations.number[6 * node as usize..6 * node as usize + 3];
            translations.iter().copied().min().unwrap_or(NONE)
        });
        column == NONE || row == NONE || self.rows(column).binary_search(&row).is_ok()
    }

    /// Adds to a number of components of two nodes that the pattern couples, translations first. The first
    /// node has the higher number or is the same.
    pub fn add_node_block(
        &mut self,
        equations: &Equations,
        [row_node, column_node]: [u32; 2],
        components: usize,
        entry: impl Fn(usize, usize) -> f64,
    ) {
        let first = equations.first(row_node);
        let columns = &equations.number[6 * column_node as usize..][..components];
        // The columns of a node that is free have the same rows, but for those above their diagonals: one
        // search finds the place in all.
        let places = columns.iter().all(|&column| column != NONE && first != NONE).then(|| {
            let start = self.column_start[columns[0] as usize];
            self.base(equations, row_node, columns[0]).wrapping_sub(start)
        });
        for (j, &column) in columns.iter().enumerate() {
            if column == NONE || first == NONE {
                continue;
            }
            let base = match places {
                Some(place) => {
                    self.column_start[column as usize].wrapping_add(place).wrapping_sub(column - columns[0])
                }
                None => self.base(equations, row_node, column),
            };
            for (i, &row) in equations.number[6 * row_node as usize..][..components].iter().enumerate() {
                if row == NONE || row < column {
                    continue;
                }
                let at = base.wrapping_add(row - first) as usize;
                self.value[at] += entry(i, j);
                if !self.mirror.is_empty() {
                    self.mirror[at] += entry(i, j);
                }
            }
        }
    }

    /// Values of an older pattern, that this one contains, in this one.
    pub fn carried(&self, older: &Self, values: &[f64]) -> Vec<f64> {
        let mut carried = vec![0.0; self.value.len()];
        for column in 0..older.columns() as u32 {
            let (from, to) = (older.column_start[column as usize], self.column_start[column as usize]);
            let rows = self.rows(column);
            for (at, row) in older.rows(column).iter().enumerate() {
                if let Ok(place) = rows.binary_search(row) {
                    carried[to as usize + place] = values[from as usize + at];
                }
            }
        }
        carried
    }

    /// Adds to a diagonal entry.
    #[inline]
    pub fn add_diagonal(&mut self, equation: usize, value: f64) {
        let at = self.column_start[equation] as usize;
        self.value[at] += value;
        if !self.mirror.is_empty() {
            self.mirror[at] += value;
        }
    }

    /// Adds a value to the diagonal entry of each equation.
    pub fn add_to_each_diagonal(&mut self, value: impl Fn(usize) -> f64 + Sync) {
        let equations = 0..self.columns();
        let (values, column_start) = self.values();
        values.add_diagonals(column_start, equations, &value);
    }

    /// Adds to an entry of a matrix that is not symmetric, if the pattern has it.
    pub fn add_entry(&mut self, row: u32, column: u32, value: f64) {
        let (low, high) = (row.min(column), row.max(column));
        let (start, end) =
            (self.column_start[low as usize] as usize, self.column_start[low as usize + 1] as usize);
        if let Ok(at) = self.row[start..end].binary_search(&high) {
            if row >= column {
                self.value[start + at] += value;
            }
            if row <= column {
                self.mirror[start + at] += value;
            }
        }
    }

    /// A diagonal entry.
    #[inline]
    pub fn diagonal(&self, equation: usize) -> f64 {
        self.value[self.column_start[equation] as usize]
    }

    /// y = A x for symmetric values in this pattern.
    pub fn multiply_values(&self, values: &[f64], x: &[f64], y: &mut [f64]) {
        y.fill(0.0);
        for (column, bounds) in self.column_start.windows(2).enumerate() {
            let (start, end) = (bounds[0] as usize, bounds[1] as usize);
            let entry = x[column];
            let mut sum = values[start] * entry;
            for (&row, &value) in self.row[start + 1..end].iter().zip(&values[start + 1..end]) {
                sum += value * x[row as usize];
                y[row as usize] += value * entry;
            }
            y[column] += sum;
        }
    }
}
