"""The steps of the app: one folder each, with its panel, jobs, views, drawing, labels and lesson."""
