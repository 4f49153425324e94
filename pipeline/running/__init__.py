"""Recipes, and what runs them: stages, people, progress, threads."""
