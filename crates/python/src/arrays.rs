//! NumPy arrays in and out. Arrays of the right type and order are not copied.

use crate::errors::bad;
use numpy::{Element, PyArray, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;

/// An array that a caller gave: contiguous, in C order, and not written to while this lives.
pub struct Input<'py, T: Element> {
    array: PyReadonlyArrayDyn<'py, T>,
    name: &'static str,
}

impl<'py, T: Element> Input<'py, T> {
    /// The array `value` as numbers of type `T`; copied only if it is something else. `name`: what the caller calls it.
    pub fn new(name: &'static str, value: &Bound<'py, PyAny>) -> PyResult<Self> {
        static CONVERT: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
        let py = value.py();
        let convert = CONVERT.import(py, "numpy", "ascontiguousarray")?;
        let failed = |e: PyErr| bad(format!("{name}: not an array of numbers ({})", e.value(py)));
        let array = convert.call1((value, numpy::dtype::<T>(py))).map_err(failed)?;
        let array = array.cast_into::<PyArrayDyn<T>>().map_err(|e| failed(e.into()))?;
        let array = array.try_readonly().map_err(|e| bad(format!("{name}: {e}")))?;
        Ok(Self { array, name })
    }

    /// Its shape.
    pub fn shape(&self) -> &[usize] {
        self.array.shape()
    }

    /// All numbers.
    pub fn numbers(&self) -> PyResult<&[T]> {
        self.array.as_slice().map_err(|e| bad(format!("{}: {e}", self.name)))
    }

    /// The rows of an array of shape (n, `N`).
    pub fn rows<const N: usize>(&self) -> PyResult<&[[T; N]]> {
        match self.shape() {
            [_, n] if *n == N => Ok(self.numbers()?.as_chunks().0),
            shape => Err(bad(format!("{}: expected the shape (n, {N}), got {}", self.name, shown(shape)))),
        }
    }

    /// An array of exactly `N` numbers.
    pub fn array<const N: usize>(&self) -> PyResult<[T; N]>
    where
        T: Copy,
    {
        let expected =
            || bad(format!("{}: expected {N} numbers, got the shape {}", self.name, shown(self.shape())));
        if self.shape().len() != 1 {
            return Err(expected());
        }
        self.numbers()?.try_into().map_err(|_| expected())
    }
}

/// `N` finite numbers from a sequence or an array.
pub fn vector<const N: usize>(name: &'static str, value: &Bound<PyAny>) -> PyResult<[f32; N]> {
    let numbers = Input::<f32>::new(name, value)?.array::<N>()?;
    if numbers.iter().all(|x| x.is_finite()) {
        Ok(numbers)
    } else {
        Err(bad(format!("{name}: {numbers:?} is not finite")))
    }
}

/// A matrix of 3×4 or 4×4 numbers that maps column vectors; the last row, if there, must be (0, 0, 0, 1). Rows.
pub fn affine_rows(name: &'static str, value: &Bound<PyAny>) -> PyResult<[[f64; 4]; 3]> {
    let input = Input::<f64>::new(name, value)?;
    let numbers = input.numbers()?;
    let is_affine = match input.shape() {
        [3, 4] => true,
        [4, 4] => numbers[12..] == [0.0, 0.0, 0.0, 1.0],
        _ => false,
    };
    if !is_affine {
        let shape = shown(input.shape());
        return Err(bad(format!(
            "{name}: expected a 4×4 matrix with the last row 0, 0, 0, 1 or a 3×4 matrix, got {shape}"
        )));
    }
    if !numbers.iter().all(|x| x.is_finite()) {
        return Err(bad(format!("{name}: the matrix is not finite")));
    }
    Ok(std::array::from_fn(|r| std::array::from_fn(|c| numbers[r * 4 + c])))
}

/// A matrix of 3×3 numbers. Rows.
pub fn square(name: &'static str, value: &Bound<PyAny>) -> PyResult<[[f64; 3]; 3]> {
    let input = Input::<f64>::new(name, value)?;
    let rows = input.rows::<3>()?;
    rows.try_into().map_err(|_| bad(format!("{name}: expected the shape (3, 3), got ({}, 3)", rows.len())))
}

/// Matrices of 4×4 numbers with the last row (0, 0, 0, 1). Rows.
pub fn matrices(name: &'static str, value: &Bound<PyAny>) -> PyResult<Vec<[[f64; 4]; 4]>> {
    let input = Input::<f64>::new(name, value)?;
    let [_, 4, 4] = input.shape() else {
        return Err(bad(format!("{name}: expected the shape (n, 4, 4), got {}", shown(input.shape()))));
    };
    let rows: &[[f64; 4]] = input.numbers()?.as_chunks().0;
    let matrices = rows.as_chunks::<4>().0;
    match matrices.iter().find(|m| m[3] != [0.0, 0.0, 0.0, 1.0]) {
        Some(m) => Err(bad(format!("{name}: the last row of a matrix is {:?}", m[3]))),
        None => Ok(matrices.to_vec()),
    }
}

/// The rows of a matrix as the affine map that the scene knows.
pub fn affine(name: &'static str, value: &Bound<PyAny>) -> PyResult<glam::Affine3A> {
    affine_map(affine_rows(name, value)?).map_err(|why| bad(format!("{name}: {why}")))
}

/// As [`affine`], from the 12 or 16 numbers of one of many matrices.
pub fn affine_of(numbers: &[f64]) -> Result<glam::Affine3A, String> {
    let (rows, last) = numbers.as_chunks::<4>().0.split_at(3);
    if let Some(last) = last.first().filter(|last| **last != [0.0, 0.0, 0.0, 1.0]) {
        return Err(format!("the last row is {last:?} instead of 0, 0, 0, 1"));
    }
    if !numbers.iter().all(|x| x.is_finite()) {
        return Err("it is not finite".into());
    }
    affine_map([rows[0], rows[1], rows[2]])
}

fn affine_map(rows: [[f64; 4]; 3]) -> Result<glam::Affine3A, String> {
    let [x, y, z] = rows.map(|row| row.map(|v| v as f32));
    let column = |i: usize| glam::Vec3::new(x[i], y[i], z[i]);
    let linear = glam::Mat3::from_cols(column(0), column(1), column(2));
    if linear.determinant().abs() <= f32::MIN_POSITIVE {
        return Err("the matrix has no inverse".into());
    }
    Ok(glam::Affine3A::from_mat3_translation(linear, column(3)))
}

/// An array of `shape` that takes the numbers over without copying them.
pub fn output<'py, T: Element>(
    py: Python<'py>,
    numbers: Vec<T>,
    shape: &[usize],
) -> PyResult<Bound<'py, PyAny>> {
    let array = PyArray::from_vec(py, numbers);
    if shape.len() == 1 { Ok(array.into_any()) } else { Ok(array.reshape(shape.to_vec())?.into_any()) }
}

/// A shape as NumPy writes it.
pub fn shown(shape: &[usize]) -> String {
    let sides: Vec<_> = shape.iter().map(usize::to_string).collect();
    if let [one] = &sides[..] { format!("({one},)") } else { format!("({})", sides.join(", ")) }
}
