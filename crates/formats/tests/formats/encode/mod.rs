mod exr;
mod mask;
mod png;
