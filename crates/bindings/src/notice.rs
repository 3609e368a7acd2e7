//! Notices as `raycam.Notice` objects, and the tables of codes.

use pyo3::prelude::*;
use raycam_scene::{ErrorCode, Notice, NoticeCode};

use crate::error::raycam_error;

mod python {
    pyo3::import_exception!(raycam.errors, Notice);
}

/// Conversion of notices to a list of `raycam.Notice`, and back.
#[derive(Clone, Debug, Default)]
pub(crate) struct Notices(pub(crate) Vec<Notice>);

impl From<Vec<Notice>> for Notices {
    fn from(notices: Vec<Notice>) -> Self {
        Self(notices)
    }
}

impl<'py> IntoPyObject<'py> for Notices {
    type Target = pyo3::types::PyList;
    type Output = Bound<'py, Self::Target>;
    type Error = PyErr;

    fn into_pyobject(self, py: Python<'py>) -> PyResult<Self::Output> {
        let class = py.get_type::<python::Notice>();
        let one = |notice: Notice| class.call1((notice.message, notice.code.name(), notice.subjects, notice.count));
        let notices = self.0.into_iter().map(one);
        pyo3::types::PyList::new(py, notices.collect::<PyResult<Vec<_>>>()?)
    }
}

impl<'py> FromPyObject<'_, 'py> for Notices {
    type Error = PyErr;

    fn extract(notices: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        let notice = |object: PyResult<Bound<'py, PyAny>>| {
            let object = object?;
            let name: String = object.getattr("code")?.extract()?;
            let code = NoticeCode::ALL.iter().copied().find(|code| code.name() == name);
            let code = code.ok_or_else(|| raycam_error(format!("unknown notice code {name:?}")))?;
            let [message, subjects, count] = ["message", "subjects", "count"].map(|name| object.getattr(name));
            Ok(Notice { code, message: message?.extract()?, subjects: subjects?.extract()?, count: count?.extract()? })
        };
        notices.try_iter()?.map(notice).collect::<PyResult<_>>().map(Self)
    }
}

/// Returns (name, cause, remedy) of every notice code and error code.
#[pyfunction]
pub(crate) fn codes() -> (Vec<[&'static str; 3]>, Vec<[&'static str; 3]>) {
    (
        NoticeCode::ALL.iter().map(|code| [code.name(), code.cause(), code.remedy()]).collect(),
        ErrorCode::ALL.iter().map(|code| [code.name(), code.cause(), code.remedy()]).collect(),
    )
}
