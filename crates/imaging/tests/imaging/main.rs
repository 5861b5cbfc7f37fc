//! Images in: every format, orientations, bad files, regions and their cleaning, fields.

mod bad;
mod cleaning;
mod fields;
mod formats;
mod labels;
mod mutation;
mod real;
