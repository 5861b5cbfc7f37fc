//! Reads Gmsh files: section after section into a model, then the mesh from the model.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use super::element_type;
use super::numbers::{Encoding, Numbers};
use crate::io::cells::{Cells, FileKind, check_filled, finite, index_limit};
use crate::io::cursor::{Cursor, Order, Scalar, name, shown};
use crate::io::error::{Fault, MeshFileProblem};
use crate::io::{Format, MeshFile};
use crate::{CellKind, DataArray, Vector3};

/// More physical groups on one entity than any mesh has; keeps hostile files from multiplying.
const MOST_GROUPS: usize = 64;

/// Numbers of the items of a file and their indices, for numbers that need not be contiguous.
#[derive(Default)]
struct Numbering {
    /// (number, index), sorted by number once `sort` was called.
    pairs: Vec<(i64, u32)>,
}

impl Numbering {
    fn push(&mut self, number: i64) {
        self.pairs.push((number, self.pairs.len() as u32));
    }

    /// Sorts by number; the number that occurs twice, if any.
    fn sort(&mut self) -> Option<i64> {
        if !self.pairs.is_sorted() {
            self.pairs.sort_unstable();
        }
        self.pairs.windows(2).find(|pair| pair[0].0 == pair[1].0).map(|pair| pair[0].0)
    }

    fn index(&self, number: i64) -> Option<u32> {
        // Nearly all files number from 1 without gaps.
        let guess = usize::try_from(number.wrapping_sub(self.pairs.first()?.0)).unwrap_or(usize::MAX);
        match self.pairs.get(guess) {
            Some(&(found, index)) if found == number => Some(index),
            _ => {
                let at = self.pairs.binary_search_by_key(&number, |pair| pair.0).ok()?;
                Some(self.pairs[at].1)
            }
        }
    }
}

/// Values that a data section gives to some nodes or elements, by number.
struct Field {
    components: usize,
    numbers: Vec<i64>,
    values: Vec<f64>,
}

/// The content of the sections so far.
#[derive(Default)]
struct Sections {
    /// Names of physical groups by dimension and number.
    names: BTreeMap<(i64, i64), String>,
    /// Physical groups of the geometrical entities (version 4) by dimension and number.
    entities: BTreeMap<(i64, i64), Vec<i64>>,
    points: Vec<Vector3>,
    nodes: Numbering,
    cells: Cells,
    /// Number in the file, per cell.
    elements: Numbering,
    /// First physical group per cell, 0 without.
    label: Vec<f64>,
    /// Geometrical entity per cell, 0 without.
    entity: Vec<f64>,
    /// Cells by dimension and number of the physical group.
    groups: BTreeMap<(i64, i64), Vec<u32>>,
    /// Cells by kind and nodes (versions 1 and 2 repeat a cell for each of its physical groups).
    seen: HashMap<(FileKind, [u32; 8]), u32>,
    repeated: usize,
    point_fields: BTreeMap<String, Field>,
    cell_fields: BTreeMap<String, Field>,
}

/// Reads a Gmsh file.
pub(crate) fn read(bytes: &[u8]) -> Result<MeshFile, Fault> {
    let mut numbers = Numbers { cursor: Cursor::new(bytes), encoding: Encoding::Text };
    let mut model = Sections::default();
    let mut notes = Vec::new();
    let mut version = "1".to_owned();
    let mut time = None;
    let mut unused = BTreeSet::new();
    while let Some(word) = numbers.cursor.word() {
        let Some(section) = word.strip_prefix(b"$") else {
            return Err(numbers
                .cursor
                .malformed(format!("`{}` found where a section must begin", shown(word))));
        };
        let four = version.starts_with('4');
        match section {
            b"MeshFormat" => version = read_format(&mut numbers)?,
            b"NOD" => read_nodes(&mut numbers, &mut model)?,
            b"Nodes" if four => read_nodes_4(&mut numbers, &mut model)?,
            b"Nodes" => read_nodes(&mut numbers, &mut model)?,
            b"ELM" => read_elements_1(&mut numbers, &mut model)?,
            b"Elements" if four => read_elements_4(&mut numbers, &mut model)?,
            b"Elements" if numbers.is_binary() => read_elements_2_binary(&mut numbers, &mut model)?,
            b"Elements" => read_elements_2(&mut numbers, &mut model)?,
            b"PhysicalNames" => read_names(&mut numbers.cursor, &mut model.names)?,
            b"Entities" if four => read_entities(&mut numbers, &mut model, false)?,
            b"PartitionedEntities" if four => read_entities(&mut numbers, &mut model, true)?,
            b"NodeData" => {
                read_field(&mut numbers, &mut model.point_fields, "node", &mut time, &mut notes)?;
            }
            b"ElementData" => {
                read_field(&mut numbers, &mut model.cell_fields, "element", &mut time, &mut notes)?;
            }
            other => {
                // Comments say nothing of the mesh, and linear elements need no scheme of interpolation.
                if other != b"Comments" && other != b"InterpolationScheme" {
                    unused.insert(shown(other));
                }
                skip_section(&mut numbers.cursor, other)?;
                continue;
            }
        }
        read_end(&mut numbers.cursor, section)?;
    }
    notes.extend(unused.into_iter().map(|section| format!("section `${section}` was ignored")));
    let encoding = if numbers.is_binary() { "binary" } else { "ASCII" };
    let mut file = model.into_file(notes, bytes.len())?;
    file.format = format!("{} {version} {encoding}", Format::Gmsh.name());
    file.time = time;
    Ok(file)
}

/// `$MeshFormat`: version, text or binary, size of a double (version 2) or of `size_t` (version 4).
fn read_format(numbers: &mut Numbers<'_>) -> Result<String, Fault> {
    let cursor = &mut numbers.cursor;
    let version = name(cursor.need_word("the format version")?);
    if !(version == "2" || version.starts_with("2.") || version == "4.1") {
        return Err(Fault::unsupported(
            cursor.place(),
            format!("Gmsh version {} is", shown(version.as_bytes())),
            "save it as 4.1 (`gmsh FILE -save -format msh41 -o NEW.msh`)",
        ));
    }
    let binary = cursor.integer(format_args!("the file type (0 text, 1 binary)"))?;
    let size = cursor.integer(format_args!("the size of its numbers"))?;
    cursor.line();
    if binary == 0 {
        return Ok(version);
    }
    let size = match (version.as_str(), size) {
        ("4.1", 8) => Scalar::I64,
        (_, 8) | ("4.1", 4) => Scalar::I32,
        _ => {
            return Err(Fault::unsupported(
                cursor.place(),
                format!("numbers of {size} bytes are"),
                "save as text",
            ));
        }
    };
    let one = cursor.take(4, "the byte order")?;
    let order = match one {
        [1, 0, 0, 0] => Order::Little,
        [0, 0, 0, 1] => Order::Big,
        _ => {
            return Err(cursor.malformed("the integer 1 that marks the byte order is invalid in both orders"));
        }
    };
    numbers.encoding = Encoding::Binary { order, size };
    Ok(version)
}

/// The end of a section: `$EndName`, in version 1 `$ENDNAME`.
fn read_end(cursor: &mut Cursor<'_>, section: &[u8]) -> Result<(), Fault> {
    let section = shown(section);
    match cursor.word() {
        Some(word) if word.len() > 4 && word[..4].eq_ignore_ascii_case(b"$End") => {
            cursor.line();
            Ok(())
        }
        Some(word) => {
            Err(cursor
                .malformed(format!("`{}` found where `${section}` must end (wrong count?)", shown(word))))
        }
        None => Err(cursor.truncated(format!("the end of `${section}`"))),
    }
}

/// Passes over a section that is not used.
fn skip_section(cursor: &mut Cursor<'_>, section: &[u8]) -> Result<(), Fault> {
    while let Some(line) = cursor.line() {
        let end = line.trim_ascii().strip_prefix(b"$");
        if end.is_some_and(|end| end.len() > 3 && end[..3].eq_ignore_ascii_case(b"End")) {
            return Ok(());
        }
    }
    Err(cursor.truncated(format!("the end of `${}`", shown(section))))
}

/// `$PhysicalNames`, text in all files: dimension, number, name in quotes.
fn read_names(cursor: &mut Cursor<'_>, names: &mut BTreeMap<(i64, i64), String>) -> Result<(), Fault> {
    let count = cursor.count(5, format_args!("the number of physical names"))?;
    for i in 1..=count {
        let dimension = cursor.integer(format_args!("the dimension of physical name {i}"))?;
        let number = cursor.integer(format_args!("the number of physical name {i}"))?;
        let Some(line) = cursor.line() else { return Err(cursor.truncated(format!("physical name {i}"))) };
        names.insert((dimension, number), name(unquoted(line)));
    }
    Ok(())
}

/// The text between the first and the last quote, or the whole text without them.
fn unquoted(line: &[u8]) -> &[u8] {
    let line = line.trim_ascii();
    match line {
        [b'"', inner @ .., b'"'] => inner,
        _ => line,
    }
}

/// `$Entities` and `$PartitionedEntities` of version 4; only their physical groups are used.
fn read_entities(numbers: &mut Numbers<'_>, model: &mut Sections, partitioned: bool) -> Result<(), Fault> {
    start_binary(numbers);
    if partitioned {
        numbers.tag(format_args!("the number of partitions"))?;
        let ghosts = numbers.count(4, 8, format_args!("the number of ghost entities"))?;
        for i in 0..2 * ghosts {
            numbers.int(format_args!("ghost entity {}", i / 2))?;
        }
    }
    let mut counts = [0; 4];
    for (dimension, count) in counts.iter_mut().enumerate() {
        *count = numbers.count(8, 36, format_args!("the number of entities of dimension {dimension}"))?;
    }
    for (dimension, count) in counts.into_iter().enumerate() {
        for i in 1..=count {
            let what = format_args!("entity {i} of dimension {dimension}");
            let tag = numbers.int(what)?;
            if partitioned {
                numbers.int(what)?;
                numbers.int(what)?;
                skip_ints(numbers, what)?;
            }
            for _ in 0..if dimension == 0 { 3 } else { 6 } {
                numbers.real(what)?;
            }
            let groups = numbers.count(2, 4, what)?;
            if groups > MOST_GROUPS {
                return Err(numbers.cursor.malformed(format!("{what} is in {groups} physical groups")));
            }
            let groups: Vec<i64> =
                (0..groups).map(|_| numbers.int(what).map(i64::saturating_abs)).collect::<Result<_, _>>()?;
            if dimension > 0 {
                skip_ints(numbers, what)?;
            }
            model.entities.insert((dimension as i64, tag), groups);
        }
    }
    Ok(())
}

/// A count and as many integers that are not used.
fn skip_ints(numbers: &mut Numbers<'_>, what: std::fmt::Arguments<'_>) -> Result<(), Fault> {
    for _ in 0..numbers.count(2, 4, what)? {
        numbers.int(what)?;
    }
    Ok(())
}

/// `$Nodes` of versions 1 and 2.
fn read_nodes(numbers: &mut Numbers<'_>, model: &mut Sections) -> Result<(), Fault> {
    // The line with the count is text even in binary files.
    let count = numbers.cursor.count(8, format_args!("the number of nodes"))?;
    start_binary(numbers);
    for i in 1..=count {
        let number = numbers.tag(format_args!("node {i} of {count}"))?;
        read_point(numbers, model, number)?;
    }
    finish_nodes(numbers, model)
}

/// Binary data begin after the end of the line with their count.
fn start_binary(numbers: &mut Numbers<'_>) {
    if numbers.is_binary() {
        numbers.cursor.line();
    }
}

fn read_point(numbers: &mut Numbers<'_>, model: &mut Sections, number: i64) -> Result<(), Fault> {
    let what = format_args!("the coordinates of node {number}");
    let (x, y, z) = (numbers.real(what)?, numbers.real(what)?, numbers.real(what)?);
    model.points.push(finite(x, y, z, number.unsigned_abs(), numbers.place())?);
    model.nodes.push(number);
    Ok(())
}

fn finish_nodes(numbers: &Numbers<'_>, model: &mut Sections) -> Result<(), Fault> {
    index_limit(model.points.len(), numbers.place())?;
    match model.nodes.sort() {
        Some(number) => Err(numbers.cursor.malformed(format!("node {number} is defined twice"))),
        None => Ok(()),
    }
}

/// `$Nodes` of version 4.1: blocks of numbers, then of coordinates.
fn read_nodes_4(numbers: &mut Numbers<'_>, model: &mut Sections) -> Result<(), Fault> {
    start_binary(numbers);
    let blocks = numbers.count(8, 16, format_args!("the number of node blocks"))?;
    numbers.count(8, 28, format_args!("the number of nodes"))?;
    numbers.tag(format_args!("the smallest node number"))?;
    numbers.tag(format_args!("the largest node number"))?;
    for block in 1..=blocks {
        let what = format_args!("node block {block} of {blocks}");
        let dimension = numbers.int(what)?;
        numbers.int(what)?;
        let parametric = numbers.int(what)? != 0;
        let count = numbers.count(8, 28, what)?;
        let tags: Vec<i64> = (0..count).map(|_| numbers.tag(what)).collect::<Result<_, _>>()?;
        for tag in tags {
            read_point(numbers, model, tag)?;
            if parametric {
                for _ in 0..dimension.clamp(0, 3) {
                    numbers.real(what)?;
                }
            }
        }
    }
    finish_nodes(numbers, model)
}

/// `$ELM` of version 1: number, type, physical group, entity, count of nodes, nodes.
fn read_elements_1(numbers: &mut Numbers<'_>, model: &mut Sections) -> Result<(), Fault> {
    let count = numbers.cursor.count(12, format_args!("the number of elements"))?;
    for i in 1..=count {
        let what = format_args!("element {i} of {count}");
        let number = numbers.int(what)?;
        let element = numbers.int(what)?;
        let physical = numbers.int(what)?;
        let entity = numbers.int(what)?;
        let nodes = numbers.count(2, 4, what)?;
        if let Some((Ok(kind), _, needed)) = element_type(element)
            && needed == nodes
        {
            let nodes = read_cell(numbers, model, kind, number)?;
            model.add_tagged(kind, nodes, number, physical, entity);
        } else {
            for _ in 0..nodes {
                numbers.int(what)?;
            }
            model.skip(element, number);
        }
    }
    model.finish_elements();
    Ok(())
}

/// `$Elements` of version 2 as text: number, type, count of tags, tags (physical group, entity, …), nodes.
fn read_elements_2(numbers: &mut Numbers<'_>, model: &mut Sections) -> Result<(), Fault> {
    let count = numbers.cursor.count(8, format_args!("the number of elements"))?;
    for i in 1..=count {
        let what = format_args!("element {i} of {count}");
        let number = numbers.int(what)?;
        let element = numbers.int(what)?;
        let (physical, entity) = read_tags(numbers, what)?;
        if let Some((Ok(kind), ..)) = element_type(element) {
            let nodes = read_cell(numbers, model, kind, number)?;
            model.add_tagged(kind, nodes, number, physical, entity);
        } else {
            numbers.cursor.line();
            model.skip(element, number);
        }
    }
    model.finish_elements();
    Ok(())
}

/// The count of tags and the tags of an element of version 2: physical group and entity, 0 without.
fn read_tags(numbers: &mut Numbers<'_>, what: std::fmt::Arguments<'_>) -> Result<(i64, i64), Fault> {
    let count = numbers.count(2, 4, what)?;
    let mut tags = (0, 0);
    for i in 0..count {
        let tag = numbers.int(what)?;
        match i {
            0 => tags.0 = tag,
            1 => tags.1 = tag,
            _ => {}
        }
    }
    Ok(tags)
}

/// `$Elements` of version 2 in binary: runs of elements of one type with one count of tags.
fn read_elements_2_binary(numbers: &mut Numbers<'_>, model: &mut Sections) -> Result<(), Fault> {
    let count = numbers.cursor.count(8, format_args!("the number of elements"))?;
    start_binary(numbers);
    let mut done = 0;
    while done < count {
        let next = done + 1;
        let what = format_args!("element {next} of {count}");
        let element = numbers.int(what)?;
        let follow = numbers.count(0, 8, what)?;
        let tags = numbers.count(0, 4, what)?;
        let Some((kind, _, node_count)) = element_type(element) else {
            return Err(unknown_type(numbers, element));
        };
        if follow == 0 {
            return Err(numbers.cursor.malformed(format!("an empty run of elements (reading {what})")));
        }
        for _ in 0..follow {
            let number = numbers.int(what)?;
            let (mut physical, mut entity) = (0, 0);
            for i in 0..tags {
                let tag = numbers.int(what)?;
                match i {
                    0 => physical = tag,
                    1 => entity = tag,
                    _ => {}
                }
            }
            if let Ok(kind) = kind {
                let nodes = read_cell(numbers, model, kind, number)?;
                model.add_tagged(kind, nodes, number, physical, entity);
            } else {
                numbers.cursor.take(4 * node_count, what)?;
                model.skip(element, number);
            }
        }
        done = done.saturating_add(follow);
    }
    model.finish_elements();
    Ok(())
}

fn unknown_type(numbers: &Numbers<'_>, element: i64) -> Fault {
    Fault::unsupported(
        numbers.place(),
        format!("Gmsh element type {element} is"),
        "save as text, or convert to linear elements (`gmsh FILE -order 1 -save`)",
    )
}

/// An element of version 4.1.
struct ElementRecord {
    number: i64,
    element: i64,
    nodes: [u32; 8],
    entity: (i64, i64),
}

/// `$Elements` of version 4.1: blocks of elements of one entity and one type. The cells are put in the order
/// of their numbers, because the blocks tear apart what belongs to several entities.
fn read_elements_4(numbers: &mut Numbers<'_>, model: &mut Sections) -> Result<(), Fault> {
    start_binary(numbers);
    let blocks = numbers.count(8, 16, format_args!("the number of element blocks"))?;
    numbers.count(4, 8, format_args!("the number of elements"))?;
    numbers.tag(format_args!("the smallest element number"))?;
    numbers.tag(format_args!("the largest element number"))?;
    let mut elements = Vec::new();
    for block in 1..=blocks {
        let what = format_args!("element block {block} of {blocks}");
        let dimension = numbers.int(what)?;
        let entity = numbers.int(what)?;
        let element = numbers.int(what)?;
        let count = numbers.count(4, 8, what)?;
        let Some((kind, _, node_count)) = element_type(element) else {
            return Err(unknown_type(numbers, element));
        };
        for _ in 0..count {
            let number = numbers.tag(what)?;
            let mut nodes = [0; 8];
            match kind {
                Ok(kind) => nodes = read_cell(numbers, model, kind, number)?,
                Err(_) => {
                    for _ in 0..node_count {
                        numbers.tag(what)?;
                    }
                }
            }
            elements.push(ElementRecord { number, element, nodes, entity: (dimension, entity) });
        }
    }
    elements.sort_by_key(|element| element.number);
    for ElementRecord { number, element, nodes, entity } in elements {
        let Some((Ok(kind), ..)) = element_type(element) else {
            model.skip(element, number);
            continue;
        };
        let groups = model.entities.get(&entity).map(Vec::as_slice).unwrap_or_default();
        let index = model.cells.len() as u32;
        for &group in groups {
            model.groups.entry((kind.dimension() as i64, group)).or_default().push(index);
        }
        let label = groups.first().copied().unwrap_or(0);
        model.add(kind, nodes, number, label, entity.1);
    }
    model.finish_elements();
    Ok(())
}

/// The nodes of a cell as indices of points.
fn read_cell(
    numbers: &mut Numbers<'_>,
    model: &Sections,
    kind: FileKind,
    number: i64,
) -> Result<[u32; 8], Fault> {
    let mut nodes = [0; 8];
    for node in &mut nodes[..kind.node_count()] {
        let tag = numbers.tag(format_args!("the nodes of element {number}"))?;
        *node = model.nodes.index(tag).ok_or_else(|| Fault {
            place: numbers.place(),
            problem: MeshFileProblem::UndefinedNode { node: tag, cell: format!("{} {number}", kind.name()) },
        })?;
    }
    Ok(nodes)
}

/// `$NodeData` and `$ElementData`: texts (the name), reals (the time), integers (step, components, count),
/// then a number and its values per item.
fn read_field(
    numbers: &mut Numbers<'_>,
    fields: &mut BTreeMap<String, Field>,
    item: &str,
    time: &mut Option<f64>,
    notes: &mut Vec<String>,
) -> Result<(), Fault> {
    let cursor = &mut numbers.cursor;
    let texts = cursor.count(2, format_args!("the number of texts of {item} data"))?;
    cursor.line();
    let mut title = String::new();
    for i in 0..texts {
        let Some(line) = cursor.line() else {
            return Err(cursor.truncated(format!("the name of {item} data")));
        };
        if i == 0 {
            title = name(unquoted(line));
        }
    }
    for i in 0..cursor.count(2, format_args!("the number of reals of {item} data `{title}`"))? {
        let real = cursor.real(format_args!("the time of {item} data `{title}`"))?;
        if i == 0 && real.is_finite() {
            *time = Some(real);
        }
    }
    let mut integers = [0, 1, 0];
    for i in 0..cursor.count(2, format_args!("the number of integers of {item} data `{title}`"))? {
        let integer = cursor.integer(format_args!("the integers of {item} data `{title}`"))?;
        if let Some(slot) = integers.get_mut(i) {
            *slot = integer;
        }
    }
    start_binary(numbers);
    let [_, components, count] = integers;
    let (Ok(components @ 1..=9), Ok(count)) = (usize::try_from(components), usize::try_from(count)) else {
        let what = format!("{item} data `{title}` announce {count} items of {components} numbers");
        return Err(numbers.cursor.malformed(what));
    };
    let each = if numbers.is_binary() { 4 + 8 * components } else { 2 + 2 * components };
    numbers.cursor.room(count, each, format_args!("{item} data `{title}`"))?;
    let mut field = Field { components, numbers: Vec::with_capacity(count), values: Vec::new() };
    for i in 1..=count {
        let what = format_args!("item {i} of {count} of {item} data `{title}`");
        field.numbers.push(numbers.int(what)?);
        for _ in 0..components {
            field.values.push(numbers.real(what)?);
        }
    }
    if fields.insert(title.clone(), field).is_some() {
        notes
            .push(format!("{item} data `{title}` occur several times (time steps?): only the last are kept"));
    }
    Ok(())
}

impl Sections {
    /// Adds a cell of versions 1 and 2, or a further physical group to a cell that is there already.
    fn add_tagged(&mut self, kind: FileKind, nodes: [u32; 8], number: i64, physical: i64, entity: i64) {
        let group = (kind.dimension() as i64, physical.saturating_abs());
        let next = self.cells.len() as u32;
        let index = *self.seen.entry((kind, nodes)).or_insert(next);
        if index == next {
            self.add(kind, nodes, number, physical.saturating_abs(), entity);
        } else {
            self.repeated += 1;
            self.elements.pairs.push((number, index));
        }
        if physical != 0 {
            self.groups.entry(group).or_default().push(index);
        }
    }

    fn add(&mut self, kind: FileKind, nodes: [u32; 8], number: i64, physical: i64, entity: i64) {
        self.elements.pairs.push((number, self.cells.len() as u32));
        self.cells.open();
        self.cells.push_of(kind, &nodes[..kind.node_count()]);
        self.label.push(physical as f64);
        self.entity.push(entity as f64);
    }

    fn skip(&mut self, element: i64, number: i64) {
        self.elements.pairs.push((number, self.cells.len() as u32));
        self.cells.open();
        match element_type(element) {
            Some((kind, name, _)) => {
                self.cells.skip(name, kind.map_or_else(|dimension| dimension, FileKind::dimension))
            }
            // Unknown types may be volumes.
            None => self.cells.skip(format!("Gmsh type {element}"), 3),
        }
        self.label.push(0.0);
        self.entity.push(0.0);
    }

    fn finish_elements(&mut self) {
        self.elements.sort();
    }

    fn into_file(mut self, mut notes: Vec<String>, file_size: usize) -> Result<MeshFile, Fault> {
        if self.repeated > 0 {
            notes.push(format!(
                "{} cells are listed once per physical group; each is kept once",
                self.repeated
            ));
        }
        let components =
            |fields: &BTreeMap<String, Field>| fields.values().map(|field| field.components).sum();
        let of_cells = self.cells.len().saturating_mul(components(&self.cell_fields));
        let of_points = self.points.len().saturating_mul(components(&self.point_fields));
        check_filled(of_cells.saturating_add(of_points), file_size)?;
        let mut label = self.label;
        if self.groups.is_empty() && self.entity.iter().any(|&entity| entity != 0.0) {
            notes
                .push("no physical groups: `label` holds the numbers of the geometrical entities".to_owned());
            label = self.entity;
        }
        self.cells
            .add_data_where("label", &DataArray::scalar(label), |labels| labels.iter().any(|&l| l != 0.0));
        for (title, field) in self.cell_fields {
            let array = field.spread(&self.elements, self.cells.len());
            self.cells.add_data(&title, &array);
        }
        let mut names_of_points = Vec::new();
        for (key, members) in self.groups {
            if let Some(name) = self.names.get(&key) {
                self.cells.add_set(name, members.into_iter().map(|member| member as usize));
                if key.0 == 0 {
                    names_of_points.push(name.clone());
                }
            }
        }
        let mut point_data = BTreeMap::new();
        for (title, field) in self.point_fields {
            point_data.insert(title, field.spread(&self.nodes, self.points.len()));
        }
        let mut mesh = self.cells.into_mesh(self.points, point_data, &mut notes)?;
        if let Some(block) = mesh.block(CellKind::Vertex) {
            let mut sets = BTreeMap::new();
            for name in names_of_points {
                let cells = block.sets.get(&name).map(Vec::as_slice).unwrap_or_default();
                let mut points: Vec<u32> = cells.iter().map(|&cell| block.cell(cell as usize)[0]).collect();
                points.sort_unstable();
                points.dedup();
                sets.insert(name, points);
            }
            mesh.point_sets.extend(sets);
        }
        Ok(MeshFile { mesh, format: String::new(), notes, time: None })
    }
}

impl Field {
    /// One item per node or cell; NaN for items missing in the file.
    fn spread(self, numbering: &Numbering, count: usize) -> DataArray {
        let mut values = vec![f64::NAN; count * self.components];
        for (number, item) in self.numbers.iter().zip(self.values.chunks_exact(self.components)) {
            if let Some(index) = numbering.index(*number) {
                let start = index as usize * self.components;
                values[start..start + self.components].copy_from_slice(item);
            }
        }
        DataArray { components: self.components, values }
    }
}
