//! Structure of the factors of a matrix before they have numbers. It has the order of elimination and the
//! columns that are eliminated together (supernodes). The assembly tree gives the supernode that takes the
//! update of another one (Duff and Reid 1983, Liu 1992). Columns with the same rows form one supernode, and
//! others where that stores few zeros (relaxed amalgamation, Ashcraft and Grimes 1989). The structure is a
//! function of the pattern alone.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::linalg::amd;
use faer::sparse::{FaerError, SymbolicSparseColMatRef};

use crate::sparse::LowerMatrix;

const NONE: u32 = u32::MAX;
/// Rows are stored in multiples of this: the widest registers.
pub(crate) const PACK: usize = 8;
/// Columns of a supernode up to which it may hold a part of zeros, from narrow ones to any. Wide fronts are
/// worth zeros: of the lens' factors these take a tenth of the time off.
const ZEROS: [(usize, f64); 3] = [(18, 0.3), (48, 0.15), (usize::MAX, 0.05)];

/// A number of rows with those that are stored after them.
pub(crate) fn padded(rows: usize) -> usize {
    rows.next_multiple_of(PACK)
}

/// Columns that are eliminated together. Their front has a panel of these columns, and an update for the rows
/// below. The panel has rows for the columns themselves and for the rows below, both padded.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Supernode {
    /// Its first column, and how many it has.
    pub first: usize,
    pub width: usize,
    /// The rows below, a range of [`Supernodes::rows`].
    rows: [usize; 2],
    /// Begin of its panel among the values.
    pub value: usize,
    /// Entries of the matrix in its columns, a range of [`Supernodes::pieces`].
    pieces: [usize; 2],
    /// Places of its rows in the front of its parent, a range of [`Supernodes::runs`].
    runs: [usize; 2],
    /// The supernodes just before it in the order that leave something to it.
    pub children: usize,
    /// Levels above it.
    pub depth: usize,
}

impl Supernode {
    /// Rows below its columns.
    pub(crate) fn below(&self) -> usize {
        self.rows[1] - self.rows[0]
    }

    /// Rows of its panel.
    pub(crate) fn height(&self) -> usize {
        padded(self.width) + padded(self.below())
    }
}

/// Rows below a supernode that follow one another in the front of its parent, too.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Run {
    pub from: u32,
    pub to: u32,
    pub len: u32,
}

/// Entries of a column of the matrix that follow one another, and in a panel lie in a column or in a row.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Piece {
    pub from: u32,
    pub to: u32,
    pub len: u32,
    pub across: bool,
}

/// Equations that follow one another and have the same neighbours, such as the equations of a node. They are
/// ordered as one, which is a sixth of the work.
struct Groups {
    /// The first equation of each group, and the end.
    start: Vec<u32>,
    /// Starts of the rows of each group. The rows are groups that it is coupled to: itself first, then groups
    /// with higher numbers.
    row_start: Vec<u32>,
    row: Vec<u32>,
}

impl Groups {
    fn new(matrix: &LowerMatrix) -> Self {
        let size = matrix.columns();
        // Columns to the left that have a row.
        let mut left_start = vec![0_u32; size + 1];
        let inner = |column: u32| &matrix.rows(column)[1..];
        (0..size as u32).flat_map(inner).for_each(|&row| left_start[row as usize + 1] += 1);
        for row in 0..size {
            left_start[row + 1] += left_start[row];
        }
        let (mut left, mut next) = (vec![0_u32; left_start[size] as usize], left_start.clone());
        for column in 0..size as u32 {
            for &row in inner(column) {
                left[next[row as usize] as usize] = column;
                next[row as usize] += 1;
            }
        }
        let left_of = |row: usize| &left[left_start[row] as usize..left_start[row + 1] as usize];
        let (mut group, mut start) = (vec![0_u32; size], Vec::new());
        for (column, group) in group.iter_mut().enumerate() {
            let follows = column > 0
                && inner(column as u32 - 1) == matrix.rows(column as u32)
                && left_of(column).split_last() == Some((&(column as u32 - 1), left_of(column - 1)));
            if !follows {
                start.push(column as u32);
            }
            *group = start.len() as u32 - 1;
        }
        let (mut row_start, mut row) = (vec![0], Vec::<u32>::new());
        for &column in &start {
            let first = row.len();
            for &equation in matrix.rows(column) {
                let number = group[equation as usize];
                if row[first..].last() != Some(&number) {
                    row.push(number);
                }
            }
            row_start.push(row.len() as u32);
        }
        start.push(size as u32);
        Self { start, row_start, row }
    }

    fn len(&self) -> usize {
        self.start.len() - 1
    }

    fn size(&self, group: u32) -> usize {
        (self.start[group as usize + 1] - self.start[group as usize]) as usize
    }

    fn rows(&self, group: usize) -> &[u32] {
        &self.row[self.row_start[group] as usize..self.row_start[group + 1] as usize]
    }

    /// An order of elimination with little fill (approximate minimum degree, Amestoy, Davis and Duff 1996).
    fn order(&self) -> Result<Vec<u32>, FaerError> {
        let count = self.len();
        let (mut order, mut place) = (vec![0_u32; count], vec![0_u32; count]);
        let memory = MemBuffer::try_new(amd::order_scratch::<u32>(count, self.row.len()));
        let mut memory = memory.map_err(|_| FaerError::OutOfMemory)?;
        let pattern = SymbolicSparseColMatRef::new_checked(count, count, &self.row_start, None, &self.row);
        let stack = MemStack::new(&mut memory);
        amd::order(&mut order, &mut place, pattern, amd::Control::default(), stack)?;
        Ok(order)
    }
}

/// Makes room for more of what grows as the factors do.
fn reserve<T>(list: &mut Vec<T>, more: usize) -> Result<(), FaerError> {
    list.try_reserve(more).map_err(|_| FaerError::OutOfMemory)
}

/// A forest as lists: the first child of each and the next one of its parent.
struct Children {
    first: Vec<u32>,
    next: Vec<u32>,
}

impl Children {
    fn new(count: usize) -> Self {
        Self { first: vec![NONE; count], next: vec![NONE; count] }
    }

    fn push(&mut self, parent: u32, child: u32) {
        self.next[child as usize] = std::mem::replace(&mut self.first[parent as usize], child);
    }

    fn of(&self, parent: u32) -> impl Iterator<Item = u32> + '_ {
        let next = |&child: &u32| Some(self.next[child as usize]).filter(|&next| next != NONE);
        std::iter::successors(Some(self.first[parent as usize]).filter(|&first| first != NONE), next)
    }
}

/// The groups of each supernode, by its last one: the first of them and the next of each.
struct Members {
    first: Vec<u32>,
    next: Vec<u32>,
}

impl Members {
    fn of(&self, last: u32) -> impl Iterator<Item = u32> + '_ {
        let next = move |&one: &u32| (one != last).then(|| self.next[one as usize]);
        std::iter::successors(Some(self.first[last as usize]), next)
    }
}

/// The factors by groups, which are numbered in the order of elimination.
struct Columns {
    /// Starts of the rows below each group, and these rows.
    row_start: Vec<usize>,
    row: Vec<u32>,
    children: Children,
    is_root: Vec<bool>,
}

impl Columns {
    fn new(groups: &Groups, place: &[u32]) -> Result<Self, FaerError> {
        let count = place.len();
        let pairs = |found: &mut dyn FnMut(usize, u32)| {
            for group in 0..count {
                for &other in &groups.rows(group)[1..] {
                    let (a, b) = (place[group], place[other as usize]);
                    found(a.min(b) as usize, a.max(b));
                }
            }
        };
        let mut start = vec![0; count + 1];
        pairs(&mut |low, _| start[low + 1] += 1);
        for at in 0..count {
            start[at + 1] += start[at];
        }
        let (mut above, mut next) = (vec![0_u32; start[count]], start.clone());
        pairs(&mut |low, high| {
            above[next[low]] = high;
            next[low] += 1;
        });
        let mut children = Children::new(count);
        let (mut row_start, mut row) = (vec![0], Vec::with_capacity(4 * above.len()));
        let (mut mark, mut is_root) = (vec![NONE; count], vec![false; count]);
        for group in 0..count as u32 {
            let first = row.len();
            mark[group as usize] = group;
            let of_children = |child: u32| row_start[child as usize + 1] - row_start[child as usize];
            let most = start[group as usize + 1] - start[group as usize]
                + children.of(group).map(of_children).sum::<usize>();
            reserve(&mut row, most)?;
            let mut take = |other: u32, row: &mut Vec<u32>| {
                if std::mem::replace(&mut mark[other as usize], group) != group {
                    row.push(other);
                }
            };
            above[start[group as usize]..start[group as usize + 1]].iter().for_each(|&q| take(q, &mut row));
            for child in children.of(group) {
                for at in row_start[child as usize]..row_start[child as usize + 1] {
                    take(row[at], &mut row);
                }
            }
            match row[first..].iter().min() {
                Some(&parent) => children.push(parent, group),
                None => is_root[group as usize] = true,
            }
            row_start.push(row.len());
        }
        Ok(Self { row_start, row, children, is_root })
    }

    fn rows(&self, group: u32) -> &[u32] {
        &self.row[self.row_start[group as usize]..self.row_start[group as usize + 1]]
    }

    /// Merges groups with their parents. Children then belong to supernodes, by their last members.
    fn merge(&mut self, size: &[usize]) -> Members {
        let count = size.len();
        let below: Vec<usize> = (0..count as u32)
            .map(|group| self.rows(group).iter().map(|&row| size[row as usize]).sum())
            .collect();
        let (mut width, mut zeros) = (size.to_vec(), vec![0; count]);
        let mut members = Members { first: (0..count as u32).collect(), next: vec![NONE; count] };
        let mut those = Vec::new();
        for group in 0..count {
            those.clear();
            those.extend(self.children.of(group as u32));
            // Those with the largest fronts leave the fewest zeros.
            those.sort_by_key(|&child| {
                std::cmp::Reverse((below[child as usize] + width[child as usize], child))
            });
            self.children.first[group] = NONE;
            for &child in &those {
                let from = child as usize;
                let new = width[from] * (width[group] + below[group] - below[from]);
                let (wide, padding) = (width[from] + width[group], zeros[from] + zeros[group] + new);
                let part = padding as f64 / (wide * (wide + 1) / 2 + wide * below[group]) as f64;
                if new == 0 || ZEROS.iter().any(|&(most, zeros)| wide <= most && part <= zeros) {
                    (width[group], zeros[group]) = (wide, padding);
                    (members.next[from], members.first[group]) = (members.first[group], members.first[from]);
                    let its: Vec<u32> = self.children.of(child).collect();
                    its.into_iter().for_each(|one| self.children.push(group as u32, one));
                } else {
                    self.children.push(group as u32, child);
                }
            }
        }
        members
    }

    /// The last members of supernodes with their depths, children just before their parents.
    fn postorder(&self) -> Vec<(u32, usize)> {
        let roots = (0..self.is_root.len() as u32).filter(|&group| self.is_root[group as usize]);
        let mut stack: Vec<(u32, usize)> = roots.map(|root| (root, 0)).collect();
        let mut post = Vec::new();
        while let Some((last, depth)) = stack.pop() {
            post.push((last, depth));
            stack.extend(self.children.of(last).map(|child| (child, depth + 1)));
        }
        post.reverse();
        post
    }
}

/// Supernodes of a matrix, in the order of elimination.
#[derive(Default)]
pub(crate) struct Supernodes {
    pub nodes: Vec<Supernode>,
    /// The equation of each column.
    pub order: Vec<u32>,
    /// Columns that are rows below, of all supernodes, increasing in each.
    rows: Vec<u32>,
    runs: Vec<Run>,
    pieces: Vec<Piece>,
    /// Numbers of all panels, of the largest one, and of the most rows below.
    pub values: usize,
    pub most_below: usize,
    pub highest: usize,
    /// Most numbers in updates of supernodes of even and of odd depth that wait for their parents.
    pub stacks: [usize; 2],
}

impl Supernodes {
    /// Finds the supernodes of a pattern.
    pub(crate) fn new(matrix: &LowerMatrix) -> Result<Self, FaerError> {
        let groups = Groups::new(matrix);
        let order = groups.order()?;
        let mut place = vec![0; order.len()];
        order.iter().zip(0..).for_each(|(&group, at)| place[group as usize] = at);
        let size: Vec<usize> = order.iter().map(|&group| groups.size(group)).collect();
        let mut columns = Columns::new(&groups, &place)?;
        let members = columns.merge(&size);
        let mut supernodes = Self::default();
        // The first column of each group, by its place.
        let mut column = vec![0_u32; order.len()];
        let post = columns.postorder();
        for &(last, depth) in &post {
            let first = supernodes.order.len();
            for member in members.of(last) {
                column[member as usize] = supernodes.order.len() as u32;
                let group = order[member as usize] as usize;
                supernodes.order.extend(groups.start[group]..groups.start[group + 1]);
            }
            let (width, children) = (supernodes.order.len() - first, columns.children.of(last).count());
            supernodes.nodes.push(Supernode { first, width, depth, children, ..Supernode::default() });
        }
        let mut owner = vec![0_u32; supernodes.order.len()];
        for (node, number) in supernodes.nodes.iter().zip(0..) {
            owner[node.first..node.first + node.width].fill(number);
        }
        supernodes.set_rows(&post, &columns, &column, &size)?;
        supernodes.set_runs(&owner)?;
        let group_column: Vec<u32> = place.iter().map(|&at| column[at as usize]).collect();
        supernodes.set_pieces(matrix, &groups, &group_column, &owner);
        Ok(supernodes)
    }

    /// The first column of a supernode, or the end of all.
    pub(crate) fn column(&self, node: usize) -> usize {
        self.nodes.get(node).map_or(self.order.len(), |node| node.first)
    }

    /// Ends of two shares of supernodes. The supernodes up to the first number, and from there up to the
    /// second, are whole subtrees; all others come after them. Two threads take a subtree each, and then one
    /// thread takes the rest. The larger subtree and the rest are together as small as they can be.
    pub(crate) fn shares(&self) -> [usize; 2] {
        let count = self.nodes.len();
        // Work before each supernode, and the first of its subtree.
        let (mut work, mut begin) = (vec![0], Vec::with_capacity(count));
        for (number, node) in self.nodes.iter().enumerate() {
            work.push(work[number] + node.height() * node.width);
            begin.push((0..node.children).fold(number, |end, _| begin[end - 1]));
        }
        let (mut least, mut shares) = (work[count], [count; 2]);
        for end in (1..=count).rev() {
            let rest = work[count] - work[end];
            if rest >= least {
                break;
            }
            let mut middle = begin[end - 1];
            while middle > 0 {
                let total = rest + work[middle].max(work[end] - work[middle]);
                if total < least {
                    (least, shares) = (total, [middle, end]);
                }
                middle = begin[middle - 1];
            }
        }
        shares
    }

    pub(crate) fn rows(&self, node: &Supernode) -> &[u32] {
        &self.rows[node.rows[0]..node.rows[1]]
    }

    pub(crate) fn runs(&self, node: &Supernode) -> &[Run] {
        &self.runs[node.runs[0]..node.runs[1]]
    }

    pub(crate) fn pieces(&self, node: &Supernode) -> &[Piece] {
        &self.pieces[node.pieces[0]..node.pieces[1]]
    }

    fn set_rows(
        &mut self,
        post: &[(u32, usize)],
        columns: &Columns,
        column: &[u32],
        size: &[usize],
    ) -> Result<(), FaerError> {
        let mut parts = Vec::new();
        for (node, &(last, _)) in self.nodes.iter_mut().zip(post) {
            parts.clear();
            let below = columns.rows(last).iter();
            parts.extend(below.map(|&row| (column[row as usize], size[row as usize] as u32)));
            parts.sort_unstable();
            let from = self.rows.len();
            reserve(&mut self.rows, parts.iter().map(|(_, size)| *size as usize).sum())?;
            self.rows.extend(parts.iter().flat_map(|&(first, size)| first..first + size));
            node.rows = [from, self.rows.len()];
            node.value = self.values;
            self.values += node.height() * node.width;
            self.most_below = self.most_below.max(node.below());
            self.highest = self.highest.max(node.height());
        }
        Ok(())
    }

    fn set_runs(&mut self, owner: &[u32]) -> Result<(), FaerError> {
        let (mut used, mut left) = ([0; 2], Vec::new());
        for number in 0..self.nodes.len() {
            let node = self.nodes[number];
            let (stack, other) = (node.depth % 2, 1 - node.depth % 2);
            let size = padded(node.below()) * node.below();
            used[stack] += size;
            self.stacks[stack] = self.stacks[stack].max(used[stack]);
            used[other] -= left.drain(left.len() - node.children..).sum::<usize>();
            left.push(size);
            let from = self.runs.len();
            if let Some(&first) = self.rows(&node).first() {
                let parent = self.nodes[owner[first as usize] as usize];
                let (edge, its) = (padded(parent.width), self.rows(&parent));
                let (mut at, mut runs) = (0, Vec::<Run>::new());
                for (row, from) in self.rows(&node).iter().zip(0..) {
                    let to =
                        match (*row as usize).checked_sub(parent.first).filter(|place| *place < parent.width)
                        {
                            Some(place) => place,
                            None => {
                                at += its[at..].iter().take_while(|other| *other != row).count();
                                edge + at
                            }
                        };
                    match runs.last_mut() {
                        // Runs end at the border between the panel and the rows below.
                        Some(run) if (run.to + run.len) as usize == to && to != edge => run.len += 1,
                        _ => runs.push(Run { from, to: to as u32, len: 1 }),
                    }
                }
                reserve(&mut self.runs, runs.len())?;
                self.runs.extend(runs);
            }
            self.nodes[number].runs = [from, self.runs.len()];
        }
        Ok(())
    }

    /// Row of a column in the panel of a supernode.
    fn row_in(&self, node: &Supernode, column: u32) -> usize {
        match (column as usize).checked_sub(node.first).filter(|place| *place < node.width) {
            Some(place) => place,
            None => padded(node.width) + self.rows(node).partition_point(|&row| row < column),
        }
    }

    fn set_pieces(&mut self, matrix: &LowerMatrix, groups: &Groups, column: &[u32], owner: &[u32]) {
        let owner_of = |a: usize, b: usize| owner[column[a].min(column[b]) as usize] as usize;
        let mut next = vec![0; self.nodes.len() + 1];
        for group in 0..groups.len() {
            for &other in groups.rows(group) {
                next[owner_of(group, other as usize) + 1] += groups.size(group as u32);
            }
        }
        for (number, node) in self.nodes.iter_mut().enumerate() {
            next[number + 1] += next[number];
            node.pieces = [next[number], next[number + 1]];
        }
        self.pieces = vec![Piece::default(); next[self.nodes.len()]];
        for group in 0..groups.len() {
            let size = groups.size(group as u32);
            // Entries of the first column above the entries of a group of rows.
            let mut above = 0;
            for &other in groups.rows(group) {
                let (other, count) = (other as usize, groups.size(other));
                let number = owner_of(group, other);
                let node = self.nodes[number];
                let height = node.height();
                let across = column[other] < column[group];
                let (low, high) = if across { (other, group) } else { (group, other) };
                let to = (column[low] as usize - node.first) * height + self.row_in(&node, column[high]);
                for c in 0..size {
                    let start = matrix.column_start[groups.start[group] as usize + c] as usize;
                    // Columns of a group lose one row each, the first of their own.
                    let (from, to, len) = match (other == group, across) {
                        (true, _) => (start, to + c * (height + 1), count - c),
                        (false, false) => (start + above - c, to + c * height, count),
                        (false, true) => (start + above - c, to + c, count),
                    };
                    self.pieces[next[number]] =
                        Piece { from: from as u32, to: to as u32, len: len as u32, across };
                    next[number] += 1;
                }
                above += count;
            }
        }
    }
}
