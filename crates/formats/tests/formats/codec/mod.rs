mod draco;
mod meshopt;
