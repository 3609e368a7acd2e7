"""Recipes: descriptions of many randomised worlds."""

from .recipe import Recipe, sample

__all__ = ["Recipe", "sample"]
