"""Worlds, documents and job pools shared by the tests."""
